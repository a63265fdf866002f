// The effects of this folder: by name, and in the order in which they act.
#pragma once
#include <array>

#include "sim/effects/effect_function.hpp"

namespace rotorloop::sim {

// Inflow, interference, boundaries.
extern const EffectInfo kRotorLocalInflow;
extern const EffectInfo kAxialInflow;
extern const EffectInfo kRotorWakeInterference;
extern const EffectInfo kRotorPairInteraction;
extern const EffectInfo kDynamicInflow;
extern const EffectInfo kTranslationalLift;
extern const EffectInfo kTorqueAdvance;
extern const EffectInfo kRotorDrag;
extern const EffectInfo kVortexRingLoss;
extern const EffectInfo kVortexRingFluctuation;
extern const EffectInfo kGroundEffectRotor;
extern const EffectInfo kGroundEffectVehicle;
extern const EffectInfo kCeilingEffect;
extern const EffectInfo kRotorWakeThrustLoss;
extern const EffectInfo kHoverInterference;
extern const EffectInfo kThrustScale;
extern const EffectInfo kThrustSpeedExponent;

extern const EffectInfo kRotorBodyInterference;
extern const EffectInfo kBlockageStrut;
extern const EffectInfo kRotorRollingMoment;
extern const EffectInfo kLateralFlapping;
extern const EffectInfo kWeakRotor;
extern const EffectInfo kThrustDrift;
extern const EffectInfo kRotorThrustDrift;
extern const EffectInfo kRotorTorqueScale;
extern const EffectInfo kRotorImbalance;
extern const EffectInfo kBladeFlapping;
extern const EffectInfo kSoftFlapping;
extern const EffectInfo kThrustLag;

// Order: what the hub's motion is, what scales it, what wakes add to it; after the solve first the differences of
// two solves, then what multiplies the in-plane force of the rigid rotor, before flapping leans the thrust into the disk plane (the
// factor is that of the blade-element force, not of the thrust); then what multiplies the thrust; thrust_lag after all other
// aerodynamic loads.
inline constexpr std::array kRotorEffects{
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
    &kThrustDrift,
    &kRotorThrustDrift,
    &kRotorTorqueScale,
    &kThrustLag,
    &kRotorImbalance,
    // clang-format on
};

}  // namespace rotorloop::sim
