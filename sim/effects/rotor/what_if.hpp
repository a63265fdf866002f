// "What would this rotor do if …": a further blade-element model for effects that are the difference between two conditions.
// Each effect owns one, so that its first guesses never mix with those of the plant's own solve.
#pragma once
#include <array>

#include "sim/airframe/airframe.hpp"
#include "sim/effects/effect.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::sim {

class WhatIf {
 public:
  // Loads of the rotor at `site` in another condition. Costs about as much as the plant's own solve of that rotor.
  RotorLoads operator()(const RotorSite& site, const RotorCondition& condition) {
    return solve_rotor(*site.rotor, condition, warm_[site.index]);
  }

 private:
  std::array<RotorWarmStart, kAirframeRotors> warm_{};
};

// Changes the shaft torque and its reaction on the hub together.
inline void add_shaft_torque(RotorLoads& loads, int spin, double torque_N_m) {
  loads.shaft_torque_N_m += torque_N_m;
  loads.moment_R_N_m.z() -= spin * torque_N_m;
}

}  // namespace rotorloop::sim
