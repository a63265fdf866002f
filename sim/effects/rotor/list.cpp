#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {

// The blades' own motion comes first, it reads the loads of the rigid rotor; thrust_lag after all other aerodynamic loads.
EffectList rotor_effects() {
  static const std::array list{
      // clang-format off
      &kBladeFlapping,
      &kSoftFlapping,
      &kRotorBodyInterference,
      &kBlockageStrut,
      &kRotorRollingMoment,
      &kLateralFlapping,
      &kWeakRotor,
      &kRotorTorqueScale,
      &kThrustLag,
      &kRotorImbalance,
      // clang-format on
  };
  return list;
}

}  // namespace rotorloop::sim
