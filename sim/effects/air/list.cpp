#include <array>

#include "sim/effects/air/air_list.hpp"
#include "sim/effects/lists.hpp"

namespace rotorloop::sim {

EffectList air_effects() {
  static const std::array list{
      &kWindSteady,
      &kWindShear,
      &kWindDryden,
      &kAirDensity,
  };
  return list;
}

}  // namespace rotorloop::sim
