// What a switchable physical effect of the plant is: an id shared with the catalogue docs/effects.toml, one parameter with
// unit and range, and the one or two places where it may act. An effect is one file; effect_set.cpp lists them all.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "sim/rotor/rotor.hpp"

namespace rotorloop::sim {

// A rotor as a spinning mass. Frame B.
struct SpinningRotor {
  Eigen::Vector3d axis_B = Eigen::Vector3d::UnitZ();  // along the thrust
  int spin = 1;                                       // +1: counter-clockwise seen from above
  double inertia_kg_m2 = 0.0;                         // about the shaft: bell, shaft and blades
  double omega_rad_s = 0.0;                           // >= 0, relative to the body
  double omega_dot_rad_s2 = 0.0;
};

// Angular momentum of the rotors relative to the body, and how fast it grows as seen in B: all that an inertial effect sees.
struct RotorMomentum {
  Eigen::Vector3d H_B_N_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d H_dot_B_N_m = Eigen::Vector3d::Zero();

  void add(const SpinningRotor& r) {
    const Eigen::Vector3d J_B_kg_m2 = (static_cast<double>(r.spin) * r.inertia_kg_m2) * r.axis_B;
    H_B_N_m_s += r.omega_rad_s * J_B_kg_m2;
    H_dot_B_N_m += r.omega_dot_rad_s2 * J_B_kg_m2;
  }
};

enum class ParameterOrigin : std::uint8_t {
  effect_entry,  // given with the [[effect]] entry of the plant file
  drive,         // follows from the motor and blade files; giving it again would be a second truth
};

struct EffectParameter {
  std::string_view key;   // name in files, with unit suffix
  std::string_view unit;  // "1" when dimensionless
  double min;
  double max;
  double neutral;  // the value at which the effect vanishes
  ParameterOrigin origin = ParameterOrigin::effect_entry;
};

struct Effect {
  std::string_view id;
  EffectParameter parameter;
  // Changes the loads that one rotor puts on its hub; `value` is the parameter. Null when the effect does not act there.
  void (*on_rotor_loads)(double value, RotorLoads& loads) = nullptr;
  // Moment on the body by the spin of its rotors, frame B, at body rate w_B. Null when the effect does not act there.
  Eigen::Vector3d (*moment_B_N_m)(const RotorMomentum& rotors, const Eigen::Vector3d& w_B_rad_s) = nullptr;
};

}  // namespace rotorloop::sim
