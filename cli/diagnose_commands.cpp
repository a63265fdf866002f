#include "cli/diagnose_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "bench/studies/command_thrust.hpp"
#include "bench/studies/hover_shares.hpp"
#include "bench/log/read_flight.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

bool has_commands_only(const log::FlightRecord& f) { return f.rotor_omega_rad_s.empty() && !f.motor_command.empty(); }

}  // namespace

bool diagnose_command_logs(const CommandLogs& logs, const host::VehicleModel& vehicle) {
  if (logs.mapping.empty()) return false;  // own logs have rotor speeds
  const log::LogMapping mapping = log::read_log_mapping(logs.mapping);
  std::vector<log::FlightRecord> flights, reference;
  for (const auto& path : logs.flights) {
    flights.push_back(log::read_flight(path, &mapping));
    if (!has_commands_only(flights.back())) return false;
  }
  if (!logs.idle_options.empty())
    throw Error({fmt::format("{}", fmt::join(logs.idle_options, ", ")), "not offered for logs that hold motor commands and no rotor speeds",
                 "such logs are compared with each other and with --reference: nothing is fitted, and there is no report or vehicle file",
                 "leave out what is named; the tables on standard output hold all there is"});
  for (const auto& path : logs.reference) reference.push_back(log::read_flight(path, &mapping));
  if (reference.size() >= 2)
    for (const auto& f : flights) std::fputs(studies::hover_text(studies::diagnose_hover(f, reference, vehicle)).c_str(), stdout);
  const bool forces =
      std::all_of(flights.begin(), flights.end(), [](const auto& f) { return !f.accel_B_m_s2.empty() && !f.battery_V.empty(); });
  if (reference.size() < 2 || (forces && flights.size() >= 3))
    std::fputs(studies::command_thrust_text(studies::diagnose_command_thrust(flights)).c_str(), stdout);
  return true;
}

}  // namespace rotorloop::cli
