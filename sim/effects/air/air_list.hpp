// The effects of this folder: by name, and in the order in which they act.
#pragma once
#include <array>

#include "sim/effects/effect_function.hpp"

namespace rotorloop::sim {

extern const EffectInfo kWindSteady;
extern const EffectInfo kWindShear;
extern const EffectInfo kWindDryden;
extern const EffectInfo kAirDensity;

inline constexpr std::array kAirEffects{
    // clang-format off
    &kWindSteady,
    &kWindShear,
    &kWindDryden,
    &kAirDensity,
    // clang-format on
};

}  // namespace rotorloop::sim
