#include <array>

#include "sim/effects/lists.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {

EffectList rotor_effects() {
  static const std::array list{
      &kRotorBodyInterference,
      &kBlockageStrut,
  };
  return list;
}

}  // namespace rotorloop::sim
