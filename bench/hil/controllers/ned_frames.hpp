// Our frames as autopilots have them: body x-forward, y-right, z-down and a world north, east, down, with our world's x to the north.
#pragma once
#include <array>

#include "host/control/controller_abi.h"

namespace rotorloop::hil {

// Of vectors in body or world: both turn about x by half a turn.
constexpr std::array<double, 3> to_ned(const double (&v)[3]) { return {v[0], -v[1], -v[2]}; }
// Body to world, w first.
constexpr std::array<double, 4> to_ned(const double (&q)[4]) { return {q[0], q[1], -q[2], -q[3]}; }

}  // namespace rotorloop::hil
