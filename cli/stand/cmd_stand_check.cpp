// `rotorloop stand check`: reads a stand file and says what stands there: rates, calibration, axes, and what should be known before a run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/stand/instruments/stand_setup.hpp"
#include "cli/stand/bus_commands.hpp"
#include "cli/stand/device_argument.hpp"
#include "host/base/error.hpp"
#include "host/base/run_clock.hpp"

namespace rotorloop::cli {
namespace {

int check_stand(const std::string& file, std::string today) {
  if (today.empty()) today = RunClock().started_utc().substr(0, 10);
  const modbus::StandSetup setup = modbus::read_stand_setup(file, profile_path);
  fmt::print("{}", modbus::stand_setup_text(setup, today));
  if (setup.expired(today))
    throw Error({setup.path.generic_string(), fmt::format("the calibration expired on {}, today is {}", setup.expires_on, today), "",
                 "calibrate again, with at least six load cases"},
                ExitCode::data_quality);
  return 0;
}

}  // namespace

void add_stand_check(CLI::App& stand, int& exit_code) {
  auto file = std::make_shared<std::string>();
  auto today = std::make_shared<std::string>();
  CLI::App* c =
      stand.add_subcommand("check", "check a stand file: instruments, axes, calibration, limits; mistakes are named with line and column");
  c->add_option("STAND", *file, "stand file")->required();
  c->add_option("--today", *today, "date for the expiry of the calibration, such as 2026-11-20; default: today (UTC)")
      ->check([](const std::string& d) {
        return d.size() == 10 && d[4] == '-' && d[7] == '-' ? std::string() : "\"" + d + "\" is no date: write it as 2026-11-20";
      });
  c->footer(
      "Example:\n  rotorloop stand check devices/examples/stand.toml\n"
      "Exit codes: 0 done; 2 a mistake in the file or a profile; 5 the calibration expired.");
  c->callback([file, today, &exit_code] { exit_code = check_stand(*file, *today); });
}

}  // namespace rotorloop::cli
