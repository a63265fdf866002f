#include "test/support/reference_blade.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/constants.hpp"
#include "host/base/elementary.hpp"
#include "sim/rotor/section_table.hpp"

namespace rotorloop::sim {
namespace {

// Between two polars (weight 0 is `a`, 1 is `b`), with Snel's stall delay, its drag and the scales of a blade file; see
// section_table.hpp for them. The polars must outlive the section.
struct PolarBlend {
  const Polar* a = nullptr;
  const Polar* b = nullptr;
  double weight = 0.0;
  double stall_delay_share = 0.0;
  double drag_scale = 1.0;
  double lift_scale = 1.0;
  double stall_drag = 0.0;
};

constexpr double kZeroLiftSearchFrom_deg = 10.0;  // attached flow begins below this in every polar of ours

SectionCoefficients blended(const PolarBlend& s, double alpha_deg, double reynolds) {
  const auto a = polar_at(*s.a, alpha_deg, reynolds);
  if (s.a == s.b) return a;
  const auto b = polar_at(*s.b, alpha_deg, reynolds);
  return {a.cl + s.weight * (b.cl - a.cl), a.cd + s.weight * (b.cd - a.cd)};
}

// Walks down from attached lift in steps of the coarser polar until lift changes sign, then interpolates; kSnelEnd_deg (no stall
// delay) for a section that never loses its lift.
double zero_lift_deg(const PolarBlend& s, double reynolds) {
  constexpr double kStep_deg = 0.5;
  double above = blended(s, kZeroLiftSearchFrom_deg, reynolds).cl;
  for (double alpha = kZeroLiftSearchFrom_deg - kStep_deg; alpha >= -180.0; alpha -= kStep_deg) {
    const double below = blended(s, alpha, reynolds).cl;
    if (above >= 0.0 && below <= 0.0) return above > below ? alpha - below / (above - below) * kStep_deg : alpha;
    above = below;
  }
  return kSnelEnd_deg;
}

// Angles by the exact elementary functions, interpolation by polar_at: nothing is prepared beforehand.
Section polar_section(const PolarBlend& s) {
  return [s](const SectionFlow& flow) {
    const double alpha_deg = flow.alpha_rad / kRad_per_deg;
    SectionCoefficients c = blended(s, alpha_deg, flow.reynolds);
    c.cd *= s.drag_scale;
    // No section loses its lift below -20 degrees, so the search is spared there.
    if (s.stall_delay_share > 0.0 && alpha_deg < kSnelEnd_deg && alpha_deg > -20.0) {
      const double zero_deg = zero_lift_deg(s, flow.reynolds);
      if (alpha_deg > zero_deg) {
        const double fade = std::min(1.0, (kSnelEnd_deg - alpha_deg) / (kSnelEnd_deg - kSnelFullTo_deg));
        const double potential = 2.0 * std::numbers::pi * sin_exact((alpha_deg - zero_deg) * kRad_per_deg);
        const double gain = s.stall_delay_share * fade * std::max(0.0, potential - c.cl);
        c.cl += gain;
        if (alpha_deg > 0.0) c.cd += s.stall_drag * gain * sin_exact(flow.alpha_rad) / cos_exact(flow.alpha_rad);
      }
    }
    c.cl *= s.lift_scale / (flow.mach > 0.0 ? std::sqrt(1.0 - flow.mach * flow.mach) : 1.0);
    return c;
  };
}

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
