#include <array>

#include "sim/effects/body/body_list.hpp"
#include "sim/effects/lists.hpp"

namespace rotorloop::sim {

EffectList body_effects() {
  static const std::array list{
      &kRotorInertiaReaction, &kGyroscopic, &kPayloadMass, &kComOffset, &kProductsOfInertia, &kRotorTilt,
      &kRotorPlaneHeight,     &kTether,     &kSlungLoad,
  };
  return list;
}

}  // namespace rotorloop::sim
