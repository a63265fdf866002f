#include "bench/hil/processes/bench_run.hpp"

#include <fmt/format.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <list>
#include <optional>

#include "bench/hil/flight/scenario.hpp"
#include "host/base/child_process.hpp"

namespace rotorloop::hil {
namespace {

constexpr int kLook_ms = 10;           // at one process after the other
constexpr int kMostToEnd_ms = 60'000;  // a process that was asked to end computes no longer than this, even on a busy machine

struct Member {
  std::string name;
  ChildProcess process;
  Member(std::string who, const ChildSetup& setup) : name(std::move(who)), process(setup) {}
};

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string ending(const Member& m, const ChildEnd& end) {
  return end.signal != 0 ? fmt::format("{} was ended by signal {}", m.name, end.signal)
                         : fmt::format("{} ended with exit code {}", m.name, end.exit_code);
}

class Bench {
 public:
  Bench(const BenchFile& bench, const BenchStart& start) : bench_(bench), start_(start) {
    for (std::size_t i = 0; i < bench.esc_nodes.size(); ++i)
      if (bench.esc_simulated[i]) add_esc(i);
    if (bench.airframe) airframe_ = add("airframe", flight_words("airframe", bench.airframe_buses, "truth.csv"));
    if (bench.fly) fly_ = add_fly();
  }

  BenchEnd run() {
    BenchEnd out;
    std::optional<ChildEnd> end;
    Member* first = nullptr;
    while (!end && !(start_.stop && start_.stop->load()))
      for (Member& m : members_)
        if (!end && (end = m.process.wait(kLook_ms))) first = &m;
    // Airframe and controller end with the same sample when the flight is over; each says itself what ended it otherwise.
    if (first && (first == airframe_ || first == fly_) && end->signal == 0) await_other(first);
    if (first) out.first = ending(*first, *end);
    stop_all();
    out.code = code_of(first);
    if (airframe_) out.airframe = text_of(start_.folder / "airframe.txt");
    for (const char* who : {"airframe_messages.txt", "fly_messages.txt"}) out.messages += text_of(start_.folder / who);
    return out;
  }

 private:
  Member* add(const std::string& name, std::vector<std::string> words) {
    const Descriptor output = output_file(start_.folder / (name + ".txt")), errors = output_file(start_.folder / (name + "_messages.txt"));
    ChildSetup setup;
    setup.program = start_.program;
    setup.arguments = std::move(words);
    setup.output = output.get();
    setup.errors = errors.get();
    return &members_.emplace_back(name, setup);
  }
  std::string in_folder(const std::string& name) const { return (start_.folder / name).string(); }

  void add_esc(std::size_t i) {
    const std::string name = fmt::format("esc{}", bench_.esc_nodes[i]);
    add(name, {"esc-sim", "--bus", bench_.esc_buses[i], "--node-id", std::to_string(bench_.esc_nodes[i]), "--esc-index", std::to_string(i),
               "--plant", read_scenario(bench_.scenario).plant.string(), "--pace", bench_.pace, "--silence",
               fmt::format("{}", bench_.silence_s), "--bridge-log", in_folder(name + "_bridge.csv")});
  }
  std::vector<std::string> flight_words(const char* command, const BenchFile::Buses& buses, const char* log) const {
    std::vector<std::string> w{command,       bench_.scenario.string(),
                               "--esc-bus",   buses.esc,
                               "--state-bus", buses.state,
                               "--pace",      bench_.pace,
                               "--wait",      fmt::format("{}", bench_.wait_s),
                               "--silence",   fmt::format("{}", bench_.silence_s),
                               "--esc-nodes", fmt::format("{}", fmt::join(bench_.esc_nodes, ",")),
                               "--log",       in_folder(log)};
    if (!bench_.flight.empty()) w.insert(w.end(), {"--flight", bench_.flight});
    if (bench_.seed != 0) w.insert(w.end(), {"--seed", std::to_string(bench_.seed)});
    if (!bench_.variant.empty()) w.insert(w.end(), {"--variant", bench_.variant});
    return w;
  }
  Member* add_fly() {
    std::vector<std::string> w = flight_words("fly", bench_.fly_buses, "flight.csv");
    w.insert(w.end(), {"--record-esc", in_folder("esc.log"), "--record-state", in_folder("state.log")});
    w.insert(w.end(), start_.fly_arguments.begin(), start_.fly_arguments.end());
    return add("fly", std::move(w));
  }

  void await_other(const Member* first) {
    Member* other = first == airframe_ ? fly_ : airframe_;
    if (other) other->process.wait(static_cast<int>(2000.0 * bench_.silence_s));
  }
  // The last ones started first: the controller disarms while everybody listens; then ESCs, whose time-outs stop them if it could not.
  void stop_all() {
    for (auto m = members_.rbegin(); m != members_.rend(); ++m) {
      m->process.signal(SIGTERM);
      if (&*m == fly_ || &*m == airframe_) m->process.wait(kMostToEnd_ms);
    }
    for (Member& m : members_) m.process.wait(kMostToEnd_ms);
  }
  ExitCode code_of(Member* first) {
    if (!first) return ExitCode::interrupted;
    if ((first != airframe_ && first != fly_) || first->process.wait(0)->signal != 0) return ExitCode::safety;
    ExitCode worst = ExitCode::ok;
    for (Member* m : {fly_, airframe_}) {
      const auto end = m ? m->process.wait(0) : std::nullopt;
      if (!end || (end->signal == 0 && (end->exit_code == 0 || end->exit_code == to_int(ExitCode::terminated)))) continue;  // stopped by us
      worst = end->signal != 0 ? ExitCode::safety : static_cast<ExitCode>(end->exit_code);
    }
    return worst;
  }

  const BenchFile& bench_;
  const BenchStart& start_;
  std::list<Member> members_;
  Member *airframe_ = nullptr, *fly_ = nullptr;
};

}  // namespace

BenchEnd run_bench(const BenchFile& bench, const BenchStart& start) { return Bench(bench, start).run(); }

}  // namespace rotorloop::hil
