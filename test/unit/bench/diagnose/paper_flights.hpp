// Flights of the paper's vehicle that obey its equations, as a fit takes them, for tests of the search for manoeuvres.
#pragma once
#include <string>
#include <vector>

#include "bench/identify/identify.hpp"
#include "host/vehicle/vehicle_file.hpp"
#include "test/support/model_true_flight.hpp"

namespace rotorloop::diagnose::testing_flights {

inline const host::VehicleFile& vehicle() {
  static const host::VehicleFile v =
      host::read_vehicle(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/paper.toml", host::builtin_effect_catalogue());
  return v;
}

// Five metres up, where the ground is not felt.
inline identify::FlightToFit flight(const model_true::Truth& truth, model_true::FlightSettings s, std::uint64_t seed) {
  s.seed = seed;
  identify::FlightToFit out{model_true::fly(truth, s).record, identify::FlightRole::any, {}, {}};
  for (log::PoseReading& z : out.record.pose.value) z.p_W_m.z() += 5.0;
  return out;
}

inline identify::IdentifyOptions options_holding(const std::vector<std::string>& held) {
  identify::IdentifyOptions o;
  o.grid.rate_Hz = 50.0;
  o.grid.longest_substep_s = 1e-2;
  o.noise.force_m_s2_rtHz.setConstant(0.03);
  o.noise.angular_rad_s2_rtHz.setConstant(0.3);
  o.wishes.hold = held;
  return o;
}

}  // namespace rotorloop::diagnose::testing_flights
