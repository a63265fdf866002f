// The effects of this folder: by name, and in the order in which they act.
#pragma once
#include <array>

#include "sim/effects/effect_function.hpp"

namespace rotorloop::sim {

extern const EffectInfo kRotorSpeedScale;
extern const EffectInfo kRotorSpeedNoise;
extern const EffectInfo kRotorSpeedDelay;
extern const EffectInfo kDriveLag;
extern const EffectInfo kMotorResistance;
extern const EffectInfo kMotorFlux;
extern const EffectInfo kBatterySag;
extern const EffectInfo kPoseDelay;
extern const EffectInfo kPoseStampJitter;
extern const EffectInfo kPoseScale;
extern const EffectInfo kGravityTilt;
extern const EffectInfo kVibrationRectification;
extern const EffectInfo kImuRotation;
extern const EffectInfo kGyroScale;
extern const EffectInfo kAccelScale;
extern const EffectInfo kClockRate;

inline constexpr std::array kSystemEffects{
    // clang-format off
    &kRotorSpeedScale,
    &kRotorSpeedNoise,
    &kRotorSpeedDelay,
    &kDriveLag,
    &kMotorResistance,
    &kMotorFlux,
    &kBatterySag,
    &kPoseDelay,
    &kPoseStampJitter,
    &kPoseScale,
    &kGravityTilt,
    &kVibrationRectification,
    &kImuRotation,
    &kGyroScale,
    &kAccelScale,
    &kClockRate,
    // clang-format on
};

}  // namespace rotorloop::sim
