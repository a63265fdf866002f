#include "cli/processes/props_off.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <limits>

#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/bus/bus_name.hpp"

namespace rotorloop::cli {

void add_props_off(CLI::App& c, PropsOff& o) {
  c.add_flag("--props-off", o.props_off, "the propellers are off, on an ESC bus that may end at motors: asked otherwise");
  c.add_option("--max-rpm", o.max_rpm, "on such a bus: no set-point above this leaves; a flight needs as much as the vehicle's rotors turn")
      ->check(CLI::Range(100.0, 32'000.0))
      ->capture_default_str();
}

bool may_have_motors(const std::string& bus) {
  const BusName name = parse_bus_name(bus, "--esc-bus");
  if (name.backend == BusBackend::multicast || name.backend == BusBackend::virtual_bus) return false;
  return name.backend != BusBackend::socketcan || !(name.rest.starts_with("vcan") || name.rest.starts_with("vxcan"));
}

double checked_ceiling_rad_s(const PropsOff& o, const std::string& esc_bus) {
  if (!may_have_motors(esc_bus)) return std::numeric_limits<double>::infinity();
  if (!o.props_off) {
    const std::string what = fmt::format("motors on {} would run, up to {:.0f} rpm", esc_bus, o.max_rpm);
    if (::isatty(STDIN_FILENO) != 1)
      throw Error(
          {"--props-off", what + ", and standard input is no terminal to ask on", "", "give --props-off when all propellers are off"});
    fmt::print(stderr, "{}. Are all propellers off? Type yes: ", what);
    std::string answer;
    if (!std::getline(std::cin, answer) || answer != "yes")
      throw Error({"--props-off", "the propellers are not off: nothing was armed", "", "take them off"}, ExitCode::safety);
  }
  return o.max_rpm * kRad_s_per_rpm;
}

}  // namespace rotorloop::cli
