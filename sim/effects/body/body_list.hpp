// The effects of this folder by name.
#pragma once
#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

extern const EffectInfo kRotorInertiaReaction;
extern const EffectInfo kGyroscopic;
extern const EffectInfo kPayloadMass;
extern const EffectInfo kComOffset;
extern const EffectInfo kProductsOfInertia;
extern const EffectInfo kRotorTilt;
extern const EffectInfo kRotorPlaneHeight;
extern const EffectInfo kTether;
extern const EffectInfo kSlungLoad;

}  // namespace rotorloop::sim
