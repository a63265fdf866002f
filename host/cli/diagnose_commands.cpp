#include "host/cli/diagnose_commands.hpp"

#include <algorithm>
#include <cstdio>

#include "bench/diagnose/command_thrust.hpp"
#include "bench/diagnose/hover_shares.hpp"

namespace rotorloop::cli {

bool has_commands_only(const bench::FlightRecord& f) { return f.rotor_omega_rad_s.empty() && !f.motor_command.empty(); }

void diagnose_command_flights(const std::vector<bench::FlightRecord>& flights, const std::vector<bench::FlightRecord>& reference,
                              const host::VehicleModel& vehicle) {
  if (reference.size() >= 2)
    for (const auto& f : flights) std::fputs(bench::hover_text(bench::diagnose_hover(f, reference, vehicle)).c_str(), stdout);
  const bool forces =
      std::all_of(flights.begin(), flights.end(), [](const auto& f) { return !f.accel_B_m_s2.empty() && !f.battery_V.empty(); });
  if (reference.size() < 2 || (forces && flights.size() >= 3))
    std::fputs(bench::command_thrust_text(bench::diagnose_command_thrust(flights)).c_str(), stdout);
}

}  // namespace rotorloop::cli
