// For effects that act on one rotor of the four, or on its torque.
#pragma once
#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

inline constexpr EffectOption kRotorNumber{"rotor", "1", 1.0, 4.0, 1.0, true};  // counted from 1, as in plant files

inline bool is_rotor(const RotorSite& site, double number) { return static_cast<double>(site.index + 1) == number; }

// Shaft torque and its reaction on the hub belong together.
inline void scale_torque(RotorLoads& loads, double factor) {
  loads.shaft_torque_N_m *= factor;
  loads.moment_R_N_m.z() *= factor;
}

}  // namespace rotorloop::sim
