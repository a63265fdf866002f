// Lift and drag of a blade section as a plain function of the flow: the analytic sections of the codes that serve as oracles.
// test/support/reference_blade.hpp adds those of our blade files.
#pragma once
#include <functional>

#include "sim/rotor/polar.hpp"

namespace rotorloop::sim {

struct SectionFlow {
  double alpha_rad = 0.0;  // angle of attack of the chord line, in [-pi, pi]
  double reynolds = 0.0;   // of the chord
  double mach = 0.0;       // 0 when compressibility is switched off; the section divides its lift by sqrt(1 - mach^2)
};
using Section = std::function<SectionCoefficients(const SectionFlow&)>;

// QPROP's section: lift linear up to limits, drag a parabola in lift scaled by Reynolds number. Beyond the limits lift follows a
// cosine and drag grows by 2 sin^2 of the angle from that of least drag. The published text has the first part; the form beyond
// the limits is the one that the stalled stations of QPROP 1.22's output obey (docs/acceptance/rotor_oracles.md).
struct QpropPolar {
  double cl0, cl_alpha_per_rad, cl_min, cl_max;
  double cd0, cd2_above, cd2_below, cl_of_cd0;
  double reynolds_reference, reynolds_exponent;
};
Section qprop_section(const QpropPolar& polar);

// cl = cl_a (sin a cos a + offset), cd = cd_a sin^2 a: a plate at any angle (NeuroBEM eq. 9-10). `offset` stands for camber; the
// paper has none, Agilicious 0.07.
Section plate_section(double cl_alpha, double offset, double cd_normal);

// cl = cl_a a, cd constant: the blade of the helicopter texts (Bailey, NACA 716; Bramwell).
Section linear_section(double cl_alpha_per_rad, double cd);

}  // namespace rotorloop::sim
