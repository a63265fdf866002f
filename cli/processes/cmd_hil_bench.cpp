// `rotorloop hil BENCH`: a flight whose parts are processes on buses.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "bench/hil/processes/bench_run.hpp"
#include "cli/ending/stop_signals.hpp"
#include "cli/hil_commands.hpp"
#include "cli/processes/props_off.hpp"
#include "host/base/error.hpp"
#include "host/base/text_file.hpp"

namespace rotorloop::cli {
namespace {

namespace fs = std::filesystem;

// A folder of its own, marked as that of a run, so that --force finds it again.
fs::path run_folder(const BenchRequest& o) {
  const fs::path folder = hil::RunFolder::create(o.out, o.name.empty() ? fs::path(o.path).stem().string() : o.name, o.force).path();
  write_text_file(folder / "run.toml", fmt::format("format = 1\nbench = \"{}\"\n", o.path));
  return folder;
}

}  // namespace

int hil_bench(const BenchRequest& o) {
  const hil::BenchFile bench = hil::read_bench(o.path);
  hil::BenchStart start;
  const auto motors = std::find_if(bench.esc_buses.begin(), bench.esc_buses.end(), may_have_motors);
  const std::string esc_bus = motors != bench.esc_buses.end() ? *motors : bench.fly_buses.esc;
  if (may_have_motors(esc_bus) && bench.fly) {
    checked_ceiling_rad_s(o.props, esc_bus);
    start.fly_arguments = {"--props-off", "--max-rpm", fmt::format("{}", o.props.max_rpm)};
  }
  start.program = fs::read_symlink("/proc/self/exe");
  start.folder = run_folder(o);
  const StopSignals stop;
  start.stop = stop.flag();
  const hil::BenchEnd end = hil::run_bench(bench, start);
  fmt::print("{}", end.airframe);
  fmt::print(stderr, "{}", end.messages);
  if (end.code != ExitCode::ok && !end.first.empty()) fmt::print(stderr, "hil: {}: all others were stopped, motors off\n", end.first);
  fmt::print("run:      {}\n", start.folder.generic_string());
  return stop.asked() ? stop.exit_code() : to_int(end.code);
}

}  // namespace rotorloop::cli
