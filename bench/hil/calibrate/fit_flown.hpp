// The best that eq. (1)-(5) can do over a flown envelope: every coefficient chosen for the least error of the loads at the flown states
// themselves. fit.hpp isolates each coefficient with points made for it; here nothing is isolated, the misfit of the equations is
// spread as flight weighs it. "Best" means:
//   k1, k2, c_dh, c_dxy, c_dz: least mean square of the force error (3-D, N) over all states, together; drag never negative;
//   c_q:                       least mean square of the yaw torque error;
//   centre of mass x, y:       least mean square of the roll and pitch torque error, thrusts being those of the fit.
// Inertia is no load; mass and geometry are taken from `geometry`.
#pragma once
#include <vector>

#include "bench/hil/calibrate/fit.hpp"

namespace rotorloop::calibrate {

struct FlownFit {
  FittedValue k1_N_s2, k2_N_s2_m, c_dh_s_m, c_dxy_N_s2_m2, c_dz_N_s2_m2;
  double k1_k2_covariance = 0.0;
  FittedValue c_q_N_m_s2, com_x_m, com_y_m;
  // Misfit, rms over the states.
  double force_xy_rms_N = 0.0, force_z_rms_N = 0.0, roll_pitch_rms_N_m = 0.0, yaw_rms_N_m = 0.0;
  std::size_t states = 0;
};

// Standard uncertainties are those of independent errors of the misfit's size: neighbouring states are not independent, so they
// understate what other flights would give. Throws Error (data quality) when the states leave a combination of coefficients unobservable.
FlownFit fit_flown(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry);

}  // namespace rotorloop::calibrate
