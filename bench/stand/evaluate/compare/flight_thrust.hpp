// The static thrust coefficient as flights see it: from the identified k1 and k2 with their covariance, and, free of any rotor model, from
// the weight that four rotors carry in hover.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/log/flight_record.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::stand {

struct FlightCoefficient {
  std::string what;                     // "k1, k2 of FILE", "hover, m g / Σ ω²"
  double c_t_N_s2 = 0.0, u_N_s2 = 0.0;  // at `air_density_kg_m3`; u without what is named in `shared`
  double air_density_kg_m3 = 0.0;
  double omega_rad_s = 0.0;  // of hover
  std::string note;          // how u came about
};

// c_t of eq. (1) and (2) in still air with u from k1, k2 and their covariance; `correlation` stands for one that the file has not.
// Without either the correlation counts as 0, which the note says.
FlightCoefficient flight_coefficient(const host::VehicleFile& vehicle, std::optional<double> correlation);

struct HoverOptions {
  double mass_kg = 0.0, mass_u_kg = 0.0;
  double air_density_kg_m3 = 0.0;
  double window_s = 1.0;     // of one mean
  double slowest_m_s = 0.3;  // horizontal speed that still counts as hover
  double speed_u = 5e-4;     // relative, of the rotors' speed sensor
};
// m (g + dv_z/dt) / (cos θ Σ ω²) over windows in which the vehicle hovers; u from the scatter of the windows (blocks), mass and rotor
// speed. Nothing for fewer than five windows.
std::optional<FlightCoefficient> hover_coefficient(const std::vector<log::FlightRecord>& flights, const HoverOptions& options);

}  // namespace rotorloop::stand
