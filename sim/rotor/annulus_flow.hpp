// Small laws of the flow at one annulus that the solve (bem.cpp) and the disk map (disk.cpp) share, with their constants.
#pragma once
#include <cmath>
#include <numbers>

namespace rotorloop::sim {

constexpr double kViscosity_Pa_s = 1.81e-5;  // of air at 293 K (Sutherland); varies 2.5 % over 10 K, Reynolds effects are weaker still
constexpr double kTiny = 1e-12;              // keeps 0/0 out at zero speed; far below any speed that matters
constexpr double kPittPeters = 15.0 * std::numbers::pi / 32.0;  // skew gain, Pitt & Peters 1981

// All speeds in m/s: v induced, w = climb + v through the disk, tip of the blade element along its circle, edge edgewise.

// Turning of the wake: the induced velocity stands across the relative flow.
inline double induced_swirl(double v, double w, double tip) { return v * w * tip / (w * w + kTiny + tip * tip); }

// Induced velocity at the rim downstream less that in the middle; it falls off linearly inwards and to minus this upstream.
// Pitt-Peters: gain times tan(chi/2) of the wake skew angle chi, without trigonometry.
inline double wake_skew(double v, double w, double edge) {
  return kPittPeters * edge / (std::sqrt(edge * edge + w * w) + std::fabs(w) + kTiny) * v;
}

}  // namespace rotorloop::sim
