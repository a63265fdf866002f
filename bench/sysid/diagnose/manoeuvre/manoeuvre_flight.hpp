// A manoeuvre as this vehicle would fly it, with the model that was fitted run backwards: attitude from the force that the path asks for,
// rotor speeds from force and torque (differential flatness, Mellinger and Kumar 2011, with the whole model in place of thrust alone).
// What comes out is a flight as the fit takes it: states, rotor speeds, and measurements that carry as much information in a second as
// those of the flights so far.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/manoeuvre/manoeuvre_catalogue.hpp"
#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::diagnose {

// What the flights so far say of the next one.
struct ManoeuvreSetting {
  estimate::ModelValues values;        // the fitted model; what is of one flight alone is at rest or as in the first
  estimate::NoiseModel noise;          // mean variances over the flights
  const estimate::GridFlight* like;    // measurements are those of this flight
  double length_ratio = 1.0;           // this vehicle's arm over the reference's
  double rotor_rad_s = 0.0;            // mean flown
  double most_rad_s = 0.0;             // a rotor is not asked for more
  double way_m = 0.0, height_m = 0.0;  // room for the manoeuvre, level and upright
  double middle_z_m = 0.0;             // where the flights were, median
};
ManoeuvreSetting manoeuvre_setting(const identify::Identification& fitted);

struct ManoeuvreFlight {
  estimate::GridFlight flight;
  std::vector<estimate::BodyState> states;
  estimate::ModelValues values;  // with the manoeuvre's payload
  estimate::NoiseModel noise;    // of its measurements
  double share = 1.0;            // of the manoeuvre's full size: what room and rotors allow
};
// Nothing: even a third of its size asks for more than rotors, room or the model's equations give.
std::optional<ManoeuvreFlight> flown(const Manoeuvre& manoeuvre, const ManoeuvreSetting& setting, double duration_s = kManoeuvre_s);

}  // namespace rotorloop::diagnose
