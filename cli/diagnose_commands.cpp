#include "cli/diagnose_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

#include "bench/studies/command_thrust.hpp"
#include "bench/studies/hover_diagnosis.hpp"
#include "bench/sysid/log/read_flight.hpp"
#include "host/base/error.hpp"

namespace rotorloop::cli {
namespace {

bool has_commands_only(const log::FlightRecord& f) { return f.rotor_omega_rad_s.empty() && !f.motor_command.empty(); }

// Returns the flights that the reference says nothing about, each with its reason; empty when there is none.
std::string print_hovers(const std::vector<log::FlightRecord>& flights, const std::vector<log::FlightRecord>& reference,
                         const host::VehicleModel& vehicle) {
  std::vector<std::string> refused;
  for (const auto& f : flights) {
    const studies::HoverDiagnosis d = studies::diagnose_hover(f, reference, vehicle);
    std::fputs(studies::hover_text(d).c_str(), stdout);
    if (!d.refused.empty()) refused.push_back(fmt::format("{}: {}", f.name, d.refused));
  }
  return fmt::format("{}", fmt::join(refused, "; "));
}

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
  const std::string refused = reference.size() >= 2 ? print_hovers(flights, reference, vehicle) : std::string();
  const bool forces =
      std::all_of(flights.begin(), flights.end(), [](const auto& f) { return !f.accel_B_m_s2.empty() && !f.battery_V.empty(); });
  if (reference.size() == 1 || (reference.empty() && !forces))
    throw Error({"--reference",
                 fmt::format("{} given, at least 2 needed: how well flights of a vehicle agree is known from several", reference.size()),
                 "", "give two or more flights of the same vehicle without the defect"});
  if (reference.size() < 2 || (forces && flights.size() >= 3))
    std::fputs(studies::command_thrust_text(studies::diagnose_command_thrust(flights)).c_str(), stdout);
  if (!refused.empty())
    throw Error({"--reference", "not of the vehicle of " + refused, "flights of another vehicle, other propellers, or a repair in between",
                 "give flights of the same vehicle in the same state, without the defect"},
                ExitCode::data_quality);
  return true;
}

}  // namespace rotorloop::cli
