// What `rotorloop airframe` and `rotorloop fly` share: which flight of a scenario, on which buses, how time goes on.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/hil/flight/flight.hpp"
#include "bench/hil/flight/flight_logs.hpp"
#include "bench/hil/processes/process_end.hpp"
#include "cli/bus/live_options.hpp"

namespace CLI {
class App;
}

namespace rotorloop::cli {

struct FlightOptions {
  std::string scenario, flight, variant, esc_bus, state_bus, pace = "realtime";
  std::uint64_t seed = 0;  // 0: the scenario's first
  double wait_s = 30.0, silence_s = 2.0, catch_up_ms = 1e-6 * static_cast<double>(Deadlines::kCatchUp_ns);
  std::vector<int> esc_nodes{21, 22, 23, 24};
  std::filesystem::path record_esc, record_state, log;
  bool force = false;
};
// `log_help`: what its log holds.
void add_flight_options(CLI::App& command, FlightOptions& options, const char* log_help);

// Pace by the words of `hil`: 0 for lockstep. Throws Error.
double pace_of(const std::string& text);

// What the options name, read, checked and opened. Throws Error.
struct OpenedFlight {
  hil::Scenario scenario;
  hil::Inputs inputs;
  hil::FlightRequest request;
  hil::ProcessPace pace;
  std::unique_ptr<TimedBus> esc, state;
};
OpenedFlight open_flight(const FlightOptions& options);

// Runs a process of a flight until it ends; what a signal does is its own. Returns the exit code of a signal, or 0.
template <class Process>
int run_flight(Process& process, OpenedFlight& opened) {
  std::array<TimedBus*, 2> buses{opened.state.get(), opened.esc.get()};
  LiveOptions limit;
  limit.for_s = 1e6;  // its own limits are far below; a signal that cuts it has an exit code
  const LiveEnd end = run_live(buses, limit, [&]() -> std::optional<std::int64_t> {
    const std::int64_t next_ns = process.advance();
    if (process.end().ended) return std::nullopt;
    return next_ns;
  });
  return end.exit_code;
}
// Writes each row of a log; on disk after each second of flight, as the process may be killed.
template <class Writer>
class FlushedLog {
 public:
  FlushedLog(const std::filesystem::path& path, const OpenedFlight& f) {
    if (!path.empty())
      writer_.emplace(path, hil::log_header(f.scenario, f.inputs.plant, f.request.flight, f.request.variant, f.request.seed));
  }
  explicit operator bool() const { return writer_.has_value(); }
  template <class Row>
  void write(const Row& row) {
    writer_->write(row);
    if (row.t_s < next_flush_s_) return;
    next_flush_s_ = row.t_s + 1.0;
    writer_->flush();
  }
  void close() {  // throws Error when the disk refused
    if (writer_) writer_->close();
  }

 private:
  std::optional<Writer> writer_;
  double next_flush_s_ = 0.0;
};
// What was lost on the buses; recordings are whole.
void close_flight(OpenedFlight& opened);
// "rotorloop fly: REASON" on stderr; the exit code.
int report_end(const char* command, const hil::ProcessEnd& end);

}  // namespace rotorloop::cli
