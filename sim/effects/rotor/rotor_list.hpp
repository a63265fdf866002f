// The effects of this folder by name.
#pragma once
#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

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
