// The sections. Angles by the exact elementary functions, interpolation by polar_at: nothing is prepared beforehand.
#include "sim/rotor/reference/section.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/rotor/section_table.hpp"

namespace rotorloop::sim {
namespace {
constexpr double kDegree = std::numbers::pi / 180.0;
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

double compressed(double cl, double mach) { return mach > 0.0 ? cl / std::sqrt(1.0 - mach * mach) : cl; }
}  // namespace

Section polar_section(const PolarBlend& s) {
  return [s](const SectionFlow& flow) {
    const double alpha_deg = flow.alpha_rad / kDegree;
    SectionCoefficients c = blended(s, alpha_deg, flow.reynolds);
    c.cd *= s.drag_scale;
    // No section loses its lift below -20 degrees, so the search is spared there.
    if (s.stall_delay_share > 0.0 && alpha_deg < kSnelEnd_deg && alpha_deg > -20.0) {
      const double zero_deg = zero_lift_deg(s, flow.reynolds);
      if (alpha_deg > zero_deg) {
        const double fade = std::min(1.0, (kSnelEnd_deg - alpha_deg) / (kSnelEnd_deg - kSnelFullTo_deg));
        const double potential = 2.0 * std::numbers::pi * sin_exact((alpha_deg - zero_deg) * kDegree);
        const double gain = s.stall_delay_share * fade * std::max(0.0, potential - c.cl);
        c.cl += gain;
        if (alpha_deg > 0.0) c.cd += s.stall_drag * gain * sin_exact(flow.alpha_rad) / cos_exact(flow.alpha_rad);
      }
    }
    c.cl = compressed(s.lift_scale * c.cl, flow.mach);
    return c;
  };
}

Section qprop_section(const QpropPolar& p) {
  return [p](const SectionFlow& flow) {
    double cl = compressed(p.cl0 + p.cl_alpha_per_rad * flow.alpha_rad, flow.mach);
    const bool stalled = cl > p.cl_max || cl < p.cl_min;
    if (stalled) cl = (cl > p.cl_max ? p.cl_max : p.cl_min) * cos_exact(flow.alpha_rad - p.cl0 / p.cl_alpha_per_rad);
    const double from_least = cl - p.cl_of_cd0;
    const double scale = pow_exact(std::max(flow.reynolds, 1.0) / p.reynolds_reference, p.reynolds_exponent);
    double cd = (p.cd0 + (from_least > 0.0 ? p.cd2_above : p.cd2_below) * from_least * from_least) * scale;
    if (stalled) {
      const double sine = sin_exact(flow.alpha_rad - (p.cl_of_cd0 - p.cl0) / p.cl_alpha_per_rad);
      cd += 2.0 * sine * sine;
    }
    return SectionCoefficients{cl, cd};
  };
}

Section plate_section(double cl_alpha, double offset, double cd_normal) {
  return [=](const SectionFlow& flow) {
    const SinCos a = sincos_exact(flow.alpha_rad);
    return SectionCoefficients{compressed(cl_alpha * (a.sin * a.cos + offset), flow.mach), cd_normal * a.sin * a.sin};
  };
}

Section linear_section(double cl_alpha_per_rad, double cd) {
  return [=](const SectionFlow& flow) { return SectionCoefficients{compressed(cl_alpha_per_rad * flow.alpha_rad, flow.mach), cd}; };
}

}  // namespace rotorloop::sim
