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
  CLI::App* c = rotor.add_subcommand("bench", "throttle to thrust against a measured motor bench; rotor drag against measured vehicles");
  c->add_option("--blade", *blade, "plan form that stands for propellers whose geometry is not published")->capture_default_str();
  c->footer(
      "Needs the measured data: ROTORLOOP_DATA names the folder that holds propellers/.\n"
      "Exit code 0: all limits met; 6: a limit missed; 5: data missing or contradicting themselves; 2: a file or argument is wrong.");
  c->callback([blade, &exit_code] { exit_code = run_bench(*blade); });
}

}  // namespace rotorloop::cli
