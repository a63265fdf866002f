// The effects of each folder, in the order in which they act. To add one: a file in the folder, its name in the folder's list header, an
// entry in effects/catalogue.toml; the unit tests walk the lists and refuse an effect that the catalogue does not describe.
#pragma once
#include <span>

#include "sim/effects/effect.hpp"

namespace rotorloop::sim {

using EffectList = std::span<const EffectInfo* const>;

EffectList rotor_effects();    // rotor/: inflow and loads of each rotor
EffectList body_effects();     // body/: forces and moments on the body, mass and geometry
EffectList air_effects();      // air/: wind and density
EffectList system_effects();   // system/: ESC, battery, sensors
EffectList foreign_effects();  // foreign/: what no catalogue knows; acts last, and is no part of builtin_effects()

}  // namespace rotorloop::sim
