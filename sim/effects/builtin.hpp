// The effects of this room by name, one per file. To add one: a file, a line here, a line in effect_set.cpp, an entry in
// docs/effects.toml; the unit tests walk the list and refuse an effect that the catalogue does not describe.
#pragma once
#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

extern const Effect kRotorInertiaReaction;
extern const Effect kGyroscopic;
extern const Effect kRotorBodyInterference;
extern const Effect kBlockageStrut;

}  // namespace rotorloop::sim
