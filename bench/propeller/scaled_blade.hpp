// A blade of another size and pitch from one whose shape is known, for propellers of which only the name is: "5136" is 5.1 inches
// across with a pitch of 3.6. Plan form over r/R, sections and the rounding of the root stay.
#pragma once
#include "sim/rotor/blade.hpp"

namespace rotorloop::propeller {

// Radii and chords by the ratio of radii; the local pitch 2 pi r tan(twist) by `pitch_ratio`, so that a helix stays a helix.
// The inertia is not scaled: whoever needs it knows the material.
sim::Blade scaled_blade(sim::Blade blade, double radius_m, double pitch_ratio);

}  // namespace rotorloop::propeller
