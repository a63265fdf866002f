#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {

// Order: what the hub's motion is, what scales it, what wakes add to it; after the solve first the terms that add (differences of
// two solves, flapping of the blades under the loads of the rigid rotor), then those that multiply what is there; thrust_lag after
// all other aerodynamic loads.
EffectList rotor_effects() {
  static const std::array list{
      // clang-format off
      &kRotorLocalInflow,
      &kAxialInflow,
      &kRotorWakeInterference,
      &kDynamicInflow,
      &kTranslationalLift,
      &kTorqueAdvance,
      &kBladeFlapping,
      &kSoftFlapping,
      &kRotorDrag,
      &kVortexRingLoss,
      &kVortexRingFluctuation,
      &kGroundEffectRotor,
      &kGroundEffectVehicle,
      &kCeilingEffect,
      &kHoverInterference,
      &kThrustScale,
      &kThrustSpeedExponent,
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
