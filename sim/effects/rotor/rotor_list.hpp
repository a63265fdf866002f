// The effects of this folder by name.
#pragma once
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
extern const EffectInfo kRotorTorqueScale;
extern const EffectInfo kRotorImbalance;
extern const EffectInfo kBladeFlapping;
extern const EffectInfo kSoftFlapping;
extern const EffectInfo kThrustLag;

}  // namespace rotorloop::sim
