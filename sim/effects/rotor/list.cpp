#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {

// Order: what the hub's motion is, what scales it, what wakes add to it; after the solve first the terms that add (differences of
// two solves), then those that multiply what is there.
EffectList rotor_effects() {
  static const std::array list{
      &kRotorLocalInflow,
      &kAxialInflow,
      &kRotorWakeInterference,
      &kDynamicInflow,
      &kTranslationalLift,
      &kTorqueAdvance,
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
  };
  return list;
}

}  // namespace rotorloop::sim
