// Fits the paper's load model, eq. (1)-(5), to a table of measured loads: k1, k2, c_q, c_dh, c_dxy, c_dz. Linear and
// separable by design of the test: propellers off gives the airframe's drag (5), all rotors alike gives thrust (1)-(2) and
// rotor drag (4), unequal pairs give the torque coefficient (3).
// In stages, as the paper does: airframe drag, then k1 and k2 from axial flow, then rotor drag with both known.
#pragma once
#include <vector>

#include "bench/hil/calibrate/load_point.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::calibrate {

struct FittedValue {
  double value = 0.0;
  double u = 0.0;  // standard uncertainty from the scatter about the fit, so it carries the model's misfit
};

struct LoadFit {
  FittedValue k1_N_s2, k2_N_s2_m, c_q_N_m_s2, c_dh_s_m, c_dxy_N_s2_m2, c_dz_N_s2_m2;
  double k1_k2_covariance = 0.0;
  double thrust_rms_N = 0.0;    // misfit of total thrust over the axial points
  double in_plane_rms_N = 0.0;  // misfit of the in-plane force
  double yaw_torque_rms_N_m = 0.0;
  std::size_t powered_points = 0, axial_points = 0;
};

// `geometry` gives rotor reactions, radius and density; its coefficients are not used.
// Throws Error (data quality) when the table lacks what a coefficient needs, and says which points to add.
LoadFit fit_loads(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry);

}  // namespace rotorloop::calibrate
