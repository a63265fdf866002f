// The effects of this folder by name.
#pragma once
#include "sim/effects/effect_function.hpp"

namespace rotorloop::sim {

extern const EffectInfo kWindSteady;
extern const EffectInfo kWindShear;
extern const EffectInfo kWindDryden;
extern const EffectInfo kAirDensity;

}  // namespace rotorloop::sim
