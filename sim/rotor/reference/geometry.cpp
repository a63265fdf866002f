// A blade file as strips for the reference rotor: a second reading of what rotor.cpp prepares for the fast solve.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/rotor/reference/geometry.hpp"

namespace rotorloop::sim {
namespace {
// Slopes of Fritsch & Butland (SIAM J. Sci. Stat. Comput. 5, 1984): weighted harmonic mean of the neighbouring secants, zero at an
// extremum, the secant at both ends. The cubic then never leaves the range of its two points.
std::vector<double> monotone_slopes(const std::vector<double>& x, const std::vector<double>& y) {
  const std::size_t n = x.size();
  std::vector<double> secant(n - 1), slope(n);
  for (std::size_t i = 0; i + 1 < n; ++i) secant[i] = (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
  slope.front() = secant.front();
  slope.back() = secant.back();
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double l = secant[i - 1], r = secant[i], hl = x[i] - x[i - 1], hr = x[i + 1] - x[i];
    slope[i] = l * r > 0.0 ? 3.0 * (hl + hr) / ((2.0 * hr + hl) / l + (hr + 2.0 * hl) / r) : 0.0;
  }
  return slope;
}

class MonotoneCubic {
 public:
  MonotoneCubic(std::vector<double> x, std::vector<double> y) : x_(std::move(x)), y_(std::move(y)), slope_(monotone_slopes(x_, y_)) {}
  double operator()(double at) const {  // held constant outside
    const double x = std::clamp(at, x_.front(), x_.back());
    const auto above = std::lower_bound(x_.begin() + 1, x_.end() - 1, x);
    const auto i = static_cast<std::size_t>(above - x_.begin());
    const double h = x_[i] - x_[i - 1], t = (x - x_[i - 1]) / h, secant = (y_[i] - y_[i - 1]) / h;
    return y_[i - 1] + t * h * (secant + (1.0 - t) * ((1.0 - t) * (slope_[i - 1] - secant) - t * (slope_[i] - secant)));
  }

 private:
  std::vector<double> x_, y_, slope_;
};
}  // namespace

ReferenceGeometry reference_geometry(const Blade& blade, int elements) {
  const auto& s = blade.stations;
  std::vector<double> r_m, chord_m, twist_deg;
  for (const BladeStation& station : s) {
    r_m.push_back(station.r_m);
    chord_m.push_back(station.chord_m);
    twist_deg.push_back(station.twist_deg);
  }
  const MonotoneCubic chord(r_m, chord_m), twist(r_m, twist_deg);
  ReferenceGeometry g{blade.blades, blade.radius_m, blade.hub_radius_m, {}};
  const double middle = 0.5 * (blade.radius_m + blade.hub_radius_m), half = 0.5 * (blade.radius_m - blade.hub_radius_m);
  const double step = std::numbers::pi / elements;
  for (int k = 0; k < elements; ++k) {
    const SinCos theta = sincos_exact((k + 0.5) * step);  // r = middle - half cos(theta): the midpoint rule in theta
    const double r = middle - half * theta.cos, width = half * theta.sin * step;
    std::size_t i = 1;
    while (i + 1 < s.size() && s[i].r_m < r) ++i;
    const double weight = std::clamp((r - s[i - 1].r_m) / (s[i].r_m - s[i - 1].r_m), 0.0, 1.0);
    const double chord_here = chord(r), per_radius = chord_here / r;
    // tanh of Snel's argument; section_table.hpp has the law.
    const double growth = exp_exact(2.0 * std::min(blade.stall_delay * per_radius * per_radius, 20.0));
    g.elements.push_back({r, width, chord_here, (twist(r) + blade.pitch_offset_deg) * std::numbers::pi / 180.0,
                          polar_section({&blade.polars.at(s[i - 1].polar), &blade.polars.at(s[i].polar), weight,
                                         (growth - 1.0) / (growth + 1.0), blade.drag_scale, blade.lift_scale, blade.stall_drag})});
  }
  return g;
}

}  // namespace rotorloop::sim
