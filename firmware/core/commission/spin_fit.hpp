// Inertia, friction and load from speeding up and coasting, flux from the coasting alone: without current the voltage is the back-EMF.
//   J dw/dt = K_t i_q - T_0 - k w²      integrated from the run's beginning, so that no speed is ever differentiated:
//   w = w_0 + K_t/J ∫i_q dt - T_0/J t - k/J ∫w² dt
#pragma once
#include "firmware/core/commission/least_squares.hpp"

namespace rotorloop::firmware {

struct SpinFit {
  float current_A = 1.0f, speed_rad_s = 1.0f;              // scales of the columns
  LeastSquares<4> sums{};                                  // K_t/J, T_0/J, k/J, w_0
  float current_s = 0.0f, speed2_s = 0.0f, time_s = 0.0f;  // integrals since the beginning, scaled
  std::array<float, 3> last{};
  // Sums over the coasting with a current against the magnet, and with it: what is taken wrong of the inductance has the other sign.
  std::array<float, 2> emf_V{}, emf_rad_s{};
};

// One sample: mechanical speed in the sense of rotation.
constexpr void integrate(SpinFit& f, float current_q_A, float speed_rad_s, float period_s) {
  const float w = speed_rad_s / f.speed_rad_s;
  f.current_s += current_q_A / f.current_A * period_s;
  f.speed2_s += w * w * period_s;
  f.time_s += period_s;
}

// The mean speed since the last call.
inline void add_speed(SpinFit& f, float speed_rad_s) {
  const std::array<float, 3> now = {f.current_s, f.time_s, f.speed2_s};
  f.sums.add({0.5f * (now[0] + f.last[0]), -0.5f * (now[1] + f.last[1]), -0.5f * (now[2] + f.last[2]), 1.0f}, speed_rad_s / f.speed_rad_s);
  f.last = now;
}

struct SpinResult {
  float flux_linkage_Wb = 0.0f, inertia_kg_m2 = 0.0f, friction_N_m = 0.0f, load_N_m_s2 = 0.0f;
  bool valid = false;
};

inline SpinResult solve(const SpinFit& f, float pole_pairs) {
  SpinResult r;
  std::array<float, 4> x{};
  if (!(f.emf_rad_s[0] > 0.0f && f.emf_rad_s[1] > 0.0f)) return r;
  r.flux_linkage_Wb = 0.5f * (f.emf_V[0] / f.emf_rad_s[0] + f.emf_V[1] / f.emf_rad_s[1]);
  if (!f.sums.solve(x) || !(x[0] > 0.0f)) return r;
  const float torque_N_m = 1.5f * pole_pairs * r.flux_linkage_Wb * f.current_A;
  r.inertia_kg_m2 = torque_N_m / (x[0] * f.speed_rad_s);
  r.friction_N_m = x[1] / x[0] * torque_N_m;
  r.load_N_m_s2 = x[2] / x[0] * torque_N_m / (f.speed_rad_s * f.speed_rad_s);
  r.valid = true;
  return r;
}

}  // namespace rotorloop::firmware
