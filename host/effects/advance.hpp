// Torque that flow along the axis adds to c_q ω² (AdvanceModel of host/vehicle/model.hpp), for any scalar of the loads.
#pragma once
#include "host/effects/dual.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

// c_q2 (J ω)². Within the range J ω is π v_z / R and does not depend on the speed.
template <class S>
S advance_torque_N_m(const AdvanceModel& model, double radius_m, const S& omega_rad_s, const S& v_z_m_s) {
  const S speed = magnitude(omega_rad_s);
  if (model.c_q2_N_m_s2 == 0.0 || value_of(speed) < kStopped_rad_s) return S(0.0);
  S j_omega = (3.14159265358979323846 / radius_m) * v_z_m_s;
  const double j = value_of(j_omega) / value_of(speed);
  if (j < model.j_low) j_omega = model.j_low * speed;
  if (j > model.j_high) j_omega = model.j_high * speed;
  return model.c_q2_N_m_s2 * j_omega * j_omega;
}

}  // namespace rotorloop::host
