#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {

EffectList system_effects() {
  static const std::array list{
      &kRotorSpeedScale,
  };
  return list;
}

}  // namespace rotorloop::sim
