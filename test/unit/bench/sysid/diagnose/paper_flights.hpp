// Flights of the paper's vehicle that obey its equations, as a fit takes them, for tests of the search for manoeuvres.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/identify/identify.hpp"
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

// Eight seconds of turns, fitted with a centre of mass that is held 1.5 mm from where it is: a torque in proportion to thrust is missing.
inline const identify::Identification& beside_the_centre() {
  static const identify::Identification r = [] {
    model_true::Truth truth;
    truth.com_offset_m.x() += 1.5e-3;
    truth.r_BS_m.x() -= 1.5e-3;  // the sensor stays where it is
    return identify::identify({flight(truth, {.manoeuvre = model_true::Manoeuvre::rotation, .duration_s = 8.0}, 5)}, vehicle(),
                              options_holding({"k_1", "k_2", "c_d,h", "Δx", "Δy"}));
  }();
  return r;
}

}  // namespace rotorloop::diagnose::testing_flights
