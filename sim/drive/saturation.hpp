// Iron that saturates: flux of an axis over its own current,
//   flux(i) = L_end i + (L_0 - L_end) i / sqrt(1 + (i / I_s)^2),   L_end = share * L_0
// odd, steepest at zero, a pure function of one current: the stored energy exists and torque 3/2 p (flux_d i_q - flux_q i_d) is
// its derivative. Cross saturation is left out.
#pragma once
#include "sim/drive/lanes.hpp"

namespace rotorloop::sim {

template <class Real>
struct AxisFlux {
  Real apparent_H;     // flux / i: in the rotational voltage and in the torque
  Real incremental_H;  // d flux / d i: in the transient
};

template <class Real>
inline AxisFlux<Real> axis_flux(const Real& inductance_H, const Real& end_share, const Real& per_knee_A, const Real& i_A) {
  const Real x = i_A * per_knee_A;
  const Real fall = 1.0 / square_root(Real(1.0 + x * x));
  const Real end_H = inductance_H * end_share, extra_H = inductance_H - end_H;
  return {end_H + extra_H * fall, end_H + extra_H * fall * fall * fall};
}

// Energy of one axis over the torque factor 3/2: the integral of i d flux.
inline double axis_energy_J(double inductance_H, double end_share, double knee_A, double i_A) {
  const double x = i_A / knee_A, end_H = inductance_H * end_share;
  return 0.5 * end_H * i_A * i_A + (inductance_H - end_H) * knee_A * knee_A * (1.0 - 1.0 / square_root(1.0 + x * x));
}

}  // namespace rotorloop::sim
