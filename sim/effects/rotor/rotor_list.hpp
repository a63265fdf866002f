// The effects of this folder by name.
#pragma once
#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

extern const EffectInfo kRotorBodyInterference;
extern const EffectInfo kBlockageStrut;

}  // namespace rotorloop::sim
