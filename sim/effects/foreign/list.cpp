#include <array>

#include "sim/effects/foreign/foreign_list.hpp"
#include "sim/effects/lists.hpp"

namespace rotorloop::sim {

EffectList foreign_effects() {
  static const std::array list{&kForeignTorqueBursts, &kForeignUpdraftColumn, &kForeignSwingingAntenna, &kForeignStickingHatch,
                               &kForeignBladeFlutter};
  return list;
}

}  // namespace rotorloop::sim
