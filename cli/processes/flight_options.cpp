#include "cli/processes/flight_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "bench/hil/flight/scenario.hpp"
#include "cli/ending/outputs.hpp"
#include "host/base/error.hpp"
#include "host/base/nearest.hpp"
#include "host/bus/bus_name.hpp"

namespace rotorloop::cli {
namespace {

std::int64_t ns(double seconds) { return static_cast<std::int64_t>(std::llround(1e9 * seconds)); }

std::size_t flight_index(const hil::Scenario& s, const std::string& name) {
  if (name.empty()) return 0;
  std::vector<std::string> names;
  for (const auto& f : s.flights) names.push_back(f.name);
  const auto it = std::find(names.begin(), names.end(), name);
  if (it == names.end())
    throw Error({"--flight", fmt::format("\"{}\" is not a flight of {}", name, s.path.generic_string()), "",
                 did_you_mean(name, names) + fmt::format("use one of: {}", fmt::join(names, ", "))});
  return static_cast<std::size_t>(it - names.begin());
}

// What only the world inside of one process can do.
void check_scenario(const hil::Scenario& s) {
  const auto refuse = [&](const char* what) {
    throw Error({s.path.generic_string(), what, "these act inside of the simulated world of one process", "fly it with rotorloop hil"});
  };
  if (!s.faults.empty()) refuse("has faults, which strike virtual buses and simulated ESCs alone");
  if (s.ablation.bus == hil::BusModel::direct || s.ablation.esc_lag_s > 0.0) refuse("takes buses or ESCs away ([ablation])");
  if (s.esc.fast_channel_Hz != 1000) refuse("has no fast channel of 1000 Hz, whose answers are the rotor speeds of the airframe");
}

std::unique_ptr<TimedBus> open(const FlightOptions& o, const std::string& bus, const char* option, const std::filesystem::path& record) {
  if (parse_bus_name(bus, option).backend == BusBackend::virtual_bus)
    throw Error({option, "a virtual bus ends at this process", "", "use mcast:0, socketcan:can0 or another bus that others can join"});
  LiveOptions live;
  live.record = record;
  live.force = o.force;
  return open_recorded(live, bus, option);
}

}  // namespace

double pace_of(const std::string& text) {
  const auto pace = hil::parse_pace(text);
  if (!pace) throw Error({"--pace", fmt::format("\"{}\" is no pace", text), "", fmt::format("give {}", hil::kPaceWords)});
  return *pace;
}

void add_flight_options(CLI::App& c, FlightOptions& o, const char* log_help) {
  c.add_option("SCENARIO", o.scenario, "scenario file (docs/files.md)")->required();
  c.add_option("--esc-bus", o.esc_bus, kBusHelp)->required();
  c.add_option("--state-bus", o.state_bus, "bus between airframe and controller, another one than that of the ESCs")->required();
  c.add_option("--flight", o.flight, "flight of the scenario; default: its first");
  c.add_option("--seed", o.seed, "seed of noise and drift; default: the scenario's first");
  c.add_option("--pace", o.pace,
               "realtime, seconds of flight per second of real time, or lockstep: the airframe waits for every answer, "
               "with rotorloop esc-sim --pace lockstep")
      ->capture_default_str();
  c.add_option("--catch-up", o.catch_up_ms, "ms behind real time that are caught up; further behind ends the flight")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  c.add_option("--wait", o.wait_s, "longest wait for the other processes, s")->check(CLI::Range(0.1, 3600.0))->capture_default_str();
  c.add_option("--silence", o.silence_s, "silence of another process that ends the flight, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  c.add_option("--esc-nodes", o.esc_nodes, "node ids of the ESCs with esc_index 0 to 3, separated by commas")
      ->delimiter(',')
      ->expected(4)
      ->check(CLI::Range(1, 125))
      ->capture_default_str();
  c.add_option("--record-esc", o.record_esc, "record the ESC bus to this file: .pcap for Wireshark, otherwise text of candump -L");
  c.add_option("--record-state", o.record_state, "the same for the state bus");
  c.add_option("--log", o.log, log_help);
  c.add_option("--variant", o.variant, "controller; default: the first of the scenario");
  add_force(c, o.force);
}

OpenedFlight open_flight(const FlightOptions& o) {
  if (o.esc_bus == o.state_bus)
    throw Error({"--state-bus", "\"" + o.state_bus + "\" is the bus of the ESCs too", "one bus does not carry both at 1 kHz",
                 "give each a bus of its own, for example --esc-bus mcast:0 --state-bus mcast:1"});
  check_outputs({{"--record-esc", o.record_esc}, {"--record-state", o.record_state}, {"--log", o.log}}, o.force);
  OpenedFlight f;
  f.pace.pace = pace_of(o.pace);
  f.pace.wait_ns = ns(o.wait_s);
  f.pace.silence_ns = ns(o.silence_s);
  f.pace.catch_up_ns = ns(1e-3 * o.catch_up_ms);
  std::transform(o.esc_nodes.begin(), o.esc_nodes.end(), f.pace.esc_nodes.begin(), [](int id) { return static_cast<std::uint8_t>(id); });
  if (std::set<int>(o.esc_nodes.begin(), o.esc_nodes.end()).size() != f.pace.esc_nodes.size())
    throw Error(
        {"--esc-nodes", fmt::format("{}: a node id stands here twice", fmt::join(o.esc_nodes, ",")), "", "give each ESC an id of its own"});
  f.scenario = hil::read_scenario(o.scenario);
  check_scenario(f.scenario);
  f.request.flight = flight_index(f.scenario, o.flight);
  f.request.variant = o.variant.empty() ? f.scenario.variants.front() : hil::parse_variants(o.variant, f.scenario.external).front();
  f.request.seed = o.seed != 0 ? o.seed : f.scenario.seeds.front();
  f.scenario.esc.kind.fill(hil::EscKind::native);  // who the ESCs are, the bus says
  f.inputs = hil::read_inputs(f.scenario);
  f.esc = open(o, o.esc_bus, "--esc-bus", o.record_esc);
  f.state = open(o, o.state_bus, "--state-bus", o.record_state);
  return f;
}

void close_flight(OpenedFlight& f) {
  for (TimedBus* bus : {f.esc.get(), f.state.get()}) {
    tell_losses(*bus);
    finish_recording(*bus);
  }
}

int report_end(const char* command, const hil::ProcessEnd& end) {
  if (!end.reason.empty()) fmt::print(stderr, "{}: {}\n", command, end.reason);
  return to_int(end.code);
}

}  // namespace rotorloop::cli
