// Moments of the air on the airframe and among the rotors, of which the paper has none.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// τ = k_m |v| (-v_y, v_x, 0).
struct BodyPitchMoment {
  static constexpr std::string_view kId = "body_pitch_moment";
  static constexpr TermParameter kParameters[] = {{"k_m_N_s2_m", "N s2/m", -2e-3, 2e-3, 2e-4, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const Vec3<S>& v = s.v_air_B_m_s;
    const S k = c[0] * square_root(dot(v, v));
    s.torque_B_N_m.x -= k * v.y;
    s.torque_B_N_m.y += k * v.x;
  }
};

// τ = Σ v_i (k_roll v_y, -k_pitch v_x): as hub_moment, with the induced velocity of each rotor in place of its speed. It fades where
// edgewise flow takes the induced velocity away, as what rotors do to each other does.
struct InducedFlowMoment {
  static constexpr std::string_view kId = "induced_flow_moment";
  static constexpr TermParameter kParameters[] = {{"k_roll_N_s2_m", "N s2/m", -5e-3, 5e-3, 2e-4, 0.0},
                                                  {"k_pitch_N_s2_m", "N s2/m", -5e-3, 5e-3, 2e-4, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    S sum{};
    for (const RotorLoad<S>& r : s.rotor) sum += r.through_m_s - r.v_air_B_m_s.z;
    s.torque_B_N_m.x += c[0] * sum * s.v_air_B_m_s.y;
    s.torque_B_N_m.y -= c[1] * sum * s.v_air_B_m_s.x;
  }
};

// τ_z = k_n v_x v_y.
struct SideslipYawMoment {
  static constexpr std::string_view kId = "sideslip_yaw_moment";
  static constexpr TermParameter kParameters[] = {{"k_n_N_s2_m", "N s2/m", -3e-3, 3e-3, 2e-4, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.torque_B_N_m.z += c[0] * s.v_air_B_m_s.x * s.v_air_B_m_s.y;
  }
};

// τ = -(c Ω_x, c Ω_y, c_yaw Ω_z).
struct RateDamping {
  static constexpr std::string_view kId = "rate_damping";
  static constexpr TermParameter kParameters[] = {{"c_N_m_s", "N m s", 0.0, 0.02, 1e-3, 0.0},
                                                  {"c_yaw_N_m_s", "N m s", 0.0, 0.02, 1e-3, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const Vec3<S>& w = s.in.rates_B_rad_s;
    s.torque_B_N_m -= Vec3<S>{c[0] * w.x, c[0] * w.y, c[1] * w.z};
  }
};

// τ = -d_2 |Ω| Ω.
struct QuadraticRateDamping {
  static constexpr std::string_view kId = "quadratic_rate_damping";
  static constexpr TermParameter kParameters[] = {{"d2_N_m_s2", "N m s2", 0.0, 2e-3, 1e-4, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const Vec3<S>& w = s.in.rates_B_rad_s;
    s.torque_B_N_m -= scaled(c[0] * square_root(dot(w, w)), w);
  }
};

}  // namespace rotorloop::host
