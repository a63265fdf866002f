// Momentum theory and what replaces it in descent, evaluated afresh at every call.
#include "sim/rotor/reference/momentum.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/rotor/inflow.hpp"  // the constants that define the ring; its table is not used

namespace rotorloop::sim {
namespace {
// kappa = (vh/vi)^2 where the quartic meets descent ratio b = -Vz/vi; b rises as x falls.
double quartic_kappa(double b) {
  double deep = -2.0, hover = 0.0;
  for (int i = 0; i < 55; ++i) {
    const double x = 0.5 * (deep + hover);
    (-x / descent_quartic(x) < b ? hover : deep) = x;
  }
  const double ratio = descent_quartic(0.5 * (deep + hover));
  return 1.0 / (ratio * ratio);
}

double quartic_kappa_slope(double b) {
  constexpr double h = 1e-4;
  return (quartic_kappa(b + h) - quartic_kappa(b - h)) / (2.0 * h);
}

// The cubic through (b0, y0) and (b1, y1) with given slopes: secant plus what bends it to them.
double cubic(double b, double b0, double y0, double slope0, double b1, double y1, double slope1) {
  const double t = (b - b0) / (b1 - b0), secant = (y1 - y0) / (b1 - b0);
  return y0 + (b - b0) * (secant + (1.0 - t) * ((1.0 - t) * (slope0 - secant) - t * (slope1 - secant)));
}

double ring_kappa(double b) {
  if (b < kRingQuarticBegin)
    return cubic(b, kRingBegin, 1.0 - kRingBegin, -1.0, kRingQuarticBegin, quartic_kappa(kRingQuarticBegin),
                 quartic_kappa_slope(kRingQuarticBegin));
  if (b < kRingQuarticEnd) return quartic_kappa(b);
  return cubic(b, kRingQuarticEnd, quartic_kappa(kRingQuarticEnd), quartic_kappa_slope(kRingQuarticEnd), kRingEnd, kRingEnd - 1.0, 1.0);
}
}  // namespace

double descent_quartic(double x) { return 1.0 - 1.125 * x - 1.372 * x * x - 1.718 * x * x * x - 0.655 * x * x * x * x; }

MassFlow reference_mass_flow(double v, double climb, double edge, Descent descent) {
  const double through2 = (climb + v) * (climb + v);
  const double momentum2 = edge * edge + through2;
  if (descent != Descent::ring || climb * v >= 0.0) return {std::sqrt(momentum2), 0.0};
  const double b = -climb / v, blown = edge / (kRingFadeEnd * std::fabs(v));
  if (b <= kRingBegin || b >= kRingEnd || blown >= 1.0) return {std::sqrt(momentum2), 0.0};
  const double m = blown * blown;
  const double ring = (1.0 - m) * (1.0 - m) * (1.0 + 2.0 * m);
  const double empirical = ring_kappa(b) * v;
  return {std::sqrt(edge * edge + (1.0 - ring) * through2 + ring * empirical * empirical), ring};
}

double prandtl_share(double f) { return 2.0 / std::numbers::pi * acos_exact(exp_exact(-std::min(f, 600.0))); }

}  // namespace rotorloop::sim
