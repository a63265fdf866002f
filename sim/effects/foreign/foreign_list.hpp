// The effects of this folder: by name, and in the order in which they act. They are physics that no catalogue and no library of terms
// knows: a plant may have them, so that a diagnosis can be shown to say "unexplained" instead of a name. Not part of builtin_effects(),
// never on unless a plant file names them.
#pragma once
#include <array>

#include "sim/effects/effect_function.hpp"

namespace rotorloop::sim {

extern const EffectInfo kForeignTorqueBursts;
extern const EffectInfo kForeignUpdraftColumn;
extern const EffectInfo kForeignSwingingAntenna;
extern const EffectInfo kForeignStickingHatch;
extern const EffectInfo kForeignBladeFlutter;
extern const EffectInfo kForeignProductMoment;

inline constexpr std::array kForeignEffects{
    // clang-format off
    &kForeignTorqueBursts,
    &kForeignUpdraftColumn,
    &kForeignSwingingAntenna,
    &kForeignStickingHatch,
    &kForeignBladeFlutter,
    &kForeignProductMoment,
    // clang-format on
};

}  // namespace rotorloop::sim
