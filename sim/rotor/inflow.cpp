// The table of the empirical branch, made from the quartic by the compiler.
#include "sim/rotor/inflow.hpp"

namespace rotorloop::sim {
namespace {
// vi/vh over x = Vz/vh in [-2, 0].
constexpr double quartic(double x) { return 1.0 + x * (-1.125 + x * (-1.372 + x * (-1.718 + x * -0.655))); }

// b = -x / w rises from 0 to about 1.95 as x falls from 0 to -2: bisect for x.
constexpr double kappa_of_quartic(double b) {
  double low = -2.0, high = 0.0;
  for (int i = 0; i < 60; ++i) {
    const double x = 0.5 * (low + high);
    (-x / quartic(x) < b ? high : low) = x;
  }
  const double w = quartic(0.5 * (low + high));
  return 1.0 / (w * w);
}

struct Knot {
  double b, value, slope;
};
constexpr Knot quartic_knot(double b) {
  constexpr double h = 1e-4;
  return {b, kappa_of_quartic(b), (kappa_of_quartic(b + h) - kappa_of_quartic(b - h)) / (2 * h)};
}
constexpr double hermite(const Knot& l, const Knot& r, double b) {
  const double d = r.b - l.b, t = (b - l.b) / d;
  const double t2 = t * t, t3 = t2 * t;
  return l.value * (2 * t3 - 3 * t2 + 1) + l.slope * d * (t3 - 2 * t2 + t) + r.value * (3 * t2 - 2 * t3) + r.slope * d * (t3 - t2);
}

constexpr std::array<double, kRingCells + 1> make_table() {
  const Knot begin{kRingBegin, 1.0 - kRingBegin, -1.0}, end{kRingEnd, kRingEnd - 1.0, 1.0};
  const Knot low = quartic_knot(kRingQuarticBegin), high = quartic_knot(kRingQuarticEnd);
  std::array<double, kRingCells + 1> table{};
  for (int i = 0; i <= kRingCells; ++i) {
    const double b = kRingBegin + (kRingEnd - kRingBegin) * i / kRingCells;
    table[static_cast<std::size_t>(i)] = b < low.b ? hermite(begin, low, b) : (b < high.b ? kappa_of_quartic(b) : hermite(high, end, b));
  }
  return table;
}
}  // namespace

constinit const std::array<double, kRingCells + 1> kRingTable = make_table();

}  // namespace rotorloop::sim
