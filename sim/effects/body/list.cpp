#include <array>

#include "sim/effects/body/body_list.hpp"
#include "sim/effects/lists.hpp"

namespace rotorloop::sim {

// parasitic_drag stands before drag_centre_offset, which takes over the drag as it then is.
EffectList body_effects() {
  static const std::array list{
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
  return list;
}

}  // namespace rotorloop::sim
