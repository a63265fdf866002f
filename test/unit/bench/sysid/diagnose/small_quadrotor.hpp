// The vehicle of the tests of verdicts, and the axes that they look at.
#pragma once
#include <cmath>

#include "bench/sysid/estimate/model/parameters.hpp"

namespace rotorloop::diagnose::testing {

inline constexpr std::size_t kForceZ = 2, kTorqueX = 3;

inline estimate::ModelValues quadrotor_of_0_7_kg_and_125_mm() {
  host::VehicleModel m;
  m.mass_kg = 0.7;
  m.inertia_kg_m2 = {2.4e-3, 3.4e-3, 5.2e-3};
  const double l = 0.125 / std::sqrt(2.0);
  m.rotors = {{{{l, -l, 0}, -1}, {{-l, l, 0}, -1}, {{l, l, 0}, 1}, {{-l, -l, 0}, 1}}};
  return estimate::model_values(m);
}

}  // namespace rotorloop::diagnose::testing
