#include "sim/effects/lists.hpp"

#include "sim/effects/air/air_list.hpp"
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/foreign/foreign_list.hpp"
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {

EffectList rotor_effects() { return kRotorEffects; }
EffectList body_effects() { return kBodyEffects; }
EffectList air_effects() { return kAirEffects; }
EffectList system_effects() { return kSystemEffects; }
EffectList foreign_effects() { return kForeignEffects; }

}  // namespace rotorloop::sim
