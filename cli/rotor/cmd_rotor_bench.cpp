// `rotorloop rotor bench`: throttle to thrust against a measured motor bench, and rotor drag against measured vehicles.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/propeller/in_plane_force.hpp"
#include "bench/propeller/motor_bench.hpp"
#include "cli/commands.hpp"
#include "cli/rotor/measured_data.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

int run_bench(const std::filesystem::path& blade_file) {
  const std::filesystem::path data = measured_data_folder();
  const propeller::MotorBenchResult motor = propeller::validate_motor_bench(data, blade_file);
  for (const std::string& line : propeller::report_lines(motor)) fmt::print("{}\n", line);
  fmt::print("\n");
  const propeller::InPlaneForce force = propeller::validate_in_plane_force(data, blade_file);
  for (const std::string& line : propeller::report_lines(force)) fmt::print("{}\n", line);
  const bool met = propeller::within_limits(motor) && propeller::within_limits(force);
  fmt::print("\n{}\n", met ? "all limits met" : "a limit is missed");
  return to_int(met ? ExitCode::ok : ExitCode::verdict);
}

}  // namespace

void add_rotor_bench(CLI::App& rotor, int& exit_code) {
  auto blade = std::make_shared<std::filesystem::path>("vehicles/blades/triblade_5in.toml");
  CLI::App* c = rotor.add_subcommand(
      "bench", "compare simulated thrust over throttle with a measured motor bench, and rotor drag with measured vehicles");
  c->add_option("--blade", *blade, "blade file used for propellers whose geometry is not published")->capture_default_str();
  c->footer(
      "Needs measured data: the environment variable ROTORLOOP_DATA is the folder that contains propellers/.\n"
      "Example:\n  ROTORLOOP_DATA=~/data rotorloop rotor bench\n"
      "Exit codes: 0 all limits met; 2 bad arguments or file; 5 data are missing or inconsistent; 6 a limit was missed.");
  c->callback([blade, &exit_code] { exit_code = run_bench(*blade); });
}

}  // namespace rotorloop::cli
