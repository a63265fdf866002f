// The sections. Angles by the exact elementary functions.
#include "sim/rotor/reference/section.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"

namespace rotorloop::sim {
namespace {
double compressed(double cl, double mach) { return mach > 0.0 ? cl / std::sqrt(1.0 - mach * mach) : cl; }
}  // namespace

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
