// The effects of this folder: by name, and in the order in which they act.
#pragma once
#include <array>

#include "sim/effects/effect_function.hpp"

namespace rotorloop::sim {

extern const EffectInfo kRotorInertiaReaction;
extern const EffectInfo kGyroscopic;
extern const EffectInfo kPayloadMass;
extern const EffectInfo kComOffset;
extern const EffectInfo kProductsOfInertia;
extern const EffectInfo kRotorTilt;
extern const EffectInfo kRotorPlaneHeight;
extern const EffectInfo kTether;
extern const EffectInfo kWorldForce;
extern const EffectInfo kHeightPull;
extern const EffectInfo kSlungLoad;
extern const EffectInfo kParasiticDrag;
extern const EffectInfo kLinearDrag;
extern const EffectInfo kDragCentreOffset;
extern const EffectInfo kBodyLift;
extern const EffectInfo kBodyPitchMoment;
extern const EffectInfo kSideslipYawMoment;
extern const EffectInfo kRateDamping;
extern const EffectInfo kQuadraticRateDamping;
extern const EffectInfo kBodyForceBias;
extern const EffectInfo kBodyTorqueBias;

// parasitic_drag stands before drag_centre_offset, which takes over the drag as it then is.
inline constexpr std::array kBodyEffects{
    // clang-format off
    &kRotorInertiaReaction,
    &kGyroscopic,
    &kPayloadMass,
    &kComOffset,
    &kProductsOfInertia,
    &kRotorTilt,
    &kRotorPlaneHeight,
    &kTether,
    &kWorldForce,
    &kHeightPull,
    &kSlungLoad,
    &kParasiticDrag,
    &kLinearDrag,
    &kDragCentreOffset,
    &kBodyLift,
    &kBodyPitchMoment,
    &kSideslipYawMoment,
    &kRateDamping,
    &kQuadraticRateDamping,
    &kBodyForceBias,
    &kBodyTorqueBias,
    // clang-format on
};

}  // namespace rotorloop::sim
