#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {

EffectList system_effects() {
  static const std::array list{
      &kRotorSpeedScale, &kRotorSpeedNoise, &kRotorSpeedDelay, &kDriveLag,  &kMotorResistance, &kMotorFlux,
      &kBatterySag,      &kPoseDelay,       &kPoseStampJitter, &kPoseScale, &kGravityTilt,     &kVibrationRectification,
  };
  return list;
}

}  // namespace rotorloop::sim
