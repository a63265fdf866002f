#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {

// Order: what the hub's motion is, what scales it, what wakes add to it; after the solve first the differences of
// two solves, then what multiplies the in-plane force of the rigid rotor, before flapping leans the thrust into the disk plane (the
// factor is that of the blade-element force, not of the thrust); then what multiplies the thrust; thrust_lag after all other
// aerodynamic loads.
EffectList rotor_effects() {
  static const std::array list{
      // clang-format off
      &kRotorLocalInflow,
      &kAxialInflow,
      &kRotorWakeInterference,
      &kRotorPairInteraction,
      &kDynamicInflow,
      &kTranslationalLift,
      &kTorqueAdvance,
      &kRotorDrag,
      &kRotorBodyInterference,
      &kBladeFlapping,
      &kSoftFlapping,
      &kVortexRingLoss,
      &kVortexRingFluctuation,
      &kGroundEffectRotor,
      &kGroundEffectVehicle,
      &kCeilingEffect,
      &kRotorWakeThrustLoss,
      &kHoverInterference,
      &kThrustScale,
      &kThrustSpeedExponent,
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
