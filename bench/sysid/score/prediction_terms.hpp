// Terms of models that are fitted to predict (multi_step_fit.hpp). Each lumps causes that are indistinguishable in a nano-drone's logs;
// they are kept out of the list of named effects in host/effects for that reason.
#pragma once
#include "host/effects/term.hpp"

namespace rotorloop::score {

// The share of eq. (3)'s torque that is used, per body axis. 1 in truth; less pays when rotor speeds are noisy or slow unknown
// moments act, which the controller's rotor speeds cancel: the torque of the speeds alone then overstates what the body does.
struct TorqueShare {
  static constexpr std::string_view kId = "prediction.torque_share";
  static constexpr host::TermParameter kParameters[] = {
      {"roll", "1", -0.5, 2.0, 0.1, 1.0}, {"pitch", "1", -0.5, 2.0, 0.1, 1.0}, {"yaw", "1", -0.5, 2.0, 0.1, 1.0}};

  template <class S>
  static void body(const S* c, host::LoadState<S>& s) {
    s.torque_B_N_m = {c[0] * s.torque_B_N_m.x, c[1] * s.torque_B_N_m.y, c[2] * s.torque_B_N_m.z};
  }
};

// Moment that turns the body away from its motion through the air: τ = Σω (c_roll v_y, -c_pitch v_x, 0). Flapping, rotors above the
// centre of mass, rear rotors in the wake of the front ones and body drag above the centre all look like this.
struct InPlaneVelocityMoment {
  static constexpr std::string_view kId = "prediction.in_plane_velocity_moment";
  static constexpr host::TermParameter kParameters[] = {{"roll", "N s2", -1e-3, 1e-3, 1e-7, 0.0},
                                                        {"pitch", "N s2", -1e-3, 1e-3, 1e-7, 0.0}};

  template <class S>
  static void body(const S* c, host::LoadState<S>& s) {
    S sum{};
    for (const S& w : s.omega_rad_s) sum += w;
    s.torque_B_N_m.x += c[0] * sum * s.v_air_B_m_s.y;
    s.torque_B_N_m.y -= c[1] * sum * s.v_air_B_m_s.x;
  }
};

// τ = -(d_roll p, d_pitch q, d_yaw r). Aerodynamic damping, and in prediction the return of the rates to zero that a controller brings
// about.
struct RateReturn {
  static constexpr std::string_view kId = "prediction.rate_return";
  static constexpr host::TermParameter kParameters[] = {
      {"roll", "N m s", 0.0, 10.0, 1e-4, 0.0}, {"pitch", "N m s", 0.0, 10.0, 1e-4, 0.0}, {"yaw", "N m s", 0.0, 10.0, 1e-4, 0.0}};

  template <class S>
  static void body(const S* c, host::LoadState<S>& s) {
    const host::Vec3<S>& w = s.in.rates_B_rad_s;
    s.torque_B_N_m -= host::Vec3<S>{c[0] * w.x, c[1] * w.y, c[2] * w.z};
  }
};

inline constexpr host::Term kTorqueShare = host::make_term<TorqueShare>();
inline constexpr host::Term kInPlaneVelocityMoment = host::make_term<InPlaneVelocityMoment>();
inline constexpr host::Term kRateReturn = host::make_term<RateReturn>();

}  // namespace rotorloop::score
