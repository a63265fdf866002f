// Blades that rise and fall once a turn, and hubs that pass on what rigid blades feel: the thrust leans and the body is turned, both in
// proportion to the velocity across the shaft. First-harmonic theory, Leishman 2006 ch. 4; here in reduced form, as linear laws.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// Stiff blades: the disk leans away from the advancing side by k v_xy, opposite for the two senses of rotation; the hub's moment that is
// left is hub_moment and rotor_rolling_moment. Unlike lateral_flapping the side force follows thrust.
struct BladeFlapping {
  static constexpr std::string_view kId = "blade_flapping";
  static constexpr TermParameter kParameters[] = {{"lean_s_m", "s/m", 0.0, 5e-3, 3e-4, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const RotorLoad<S>& r = s.rotor[i];
      const S side = spin(s, i) * c[0] * r.thrust_N;
      push_at_hub(s, i, -(side * r.v_air_B_m_s.y), side * r.v_air_B_m_s.x);
    }
  }
};

// Freely hinged blades: thrust leans back by share a_1 / (ωR) v_xy and stays behind a turning body by share 16 / (γ ω) Ω; the hub is
// rid of as much of what rigid blades would pass on (hub_moment, rotor_rolling_moment).
struct SoftFlapping {
  static constexpr std::string_view kId = "soft_flapping";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 1.0, 0.3, 0.0}};
  // 8/3 θ + 2 λ with 12 degrees of pitch and the inflow of hover: 5.2 degrees back at 8.5 m/s and 945 rad/s. Size known to a third.
  static constexpr double kLeanPerAdvance = 0.65;
  static constexpr double kLockNumber = 0.5;  // moulded 5-inch blade: 2 degrees per rad/s at 945 rad/s. Size known to a factor of two.

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    if (i == 0) s.hub_moment_share -= c[0];
  }

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const RotorLoad<S>& r = s.rotor[i];
      const S speed = magnitude(s.omega_rad_s[i]);
      if (value_of(speed) < kStopped_rad_s) continue;
      const S per_speed = c[0] * r.thrust_N / speed;
      const S back = per_speed * (kLeanPerAdvance / s.geometry.radius_m), behind = per_speed * (16.0 / kLockNumber);
      const Vec3<S>& w = s.in.rates_B_rad_s;  // the shaft's tip moves with Ω x e_z = (Ω_y, -Ω_x)
      push_at_hub(s, i, -(back * r.v_air_B_m_s.x + behind * w.y), behind * w.x - back * r.v_air_B_m_s.y);
    }
  }
};

// f_i = s_i k_l ω_i (e_z x v_xy).
struct LateralFlapping {
  static constexpr std::string_view kId = "lateral_flapping";
  static constexpr TermParameter kParameters[] = {{"k_l_N_s2_m", "N s2/m", -1e-5, 1e-5, 2e-6, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const S side = spin(s, i) * c[0] * magnitude(s.omega_rad_s[i]);
      push_at_hub(s, i, -(side * s.rotor[i].v_air_B_m_s.y), side * s.rotor[i].v_air_B_m_s.x);
    }
  }
};

// τ_i = -s_i μ_R ω_i v_xy: more lift on the advancing blades of a stiff rotor. Cancels over rotors of equal speed.
struct RotorRollingMoment {
  static constexpr std::string_view kId = "rotor_rolling_moment";
  static constexpr TermParameter kParameters[] = {{"mu_R_N_s2", "N s2", 0.0, 5e-6, 1e-6, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const S k = spin(s, i) * c[0] * magnitude(s.omega_rad_s[i]) * s.hub_moment_share;
      s.torque_B_N_m.x -= k * s.rotor[i].v_air_B_m_s.x;
      s.torque_B_N_m.y -= k * s.rotor[i].v_air_B_m_s.y;
    }
  }
};

// The part of a stiff rotor's moment that has the same sign for both senses of rotation: the front half of the disk meets more upwash
// than the rear, which raises the side that flies ahead: τ_i = k ω_i (v_y, -v_x). Also what else grows with v and rotor speed.
struct HubMoment {
  static constexpr std::string_view kId = "hub_moment";
  static constexpr TermParameter kParameters[] = {{"k_roll_N_s2", "N s2", -2e-5, 2e-5, 1e-6, 0.0},
                                                  {"k_pitch_N_s2", "N s2", -2e-5, 2e-5, 1e-6, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    S sum{};
    for (const S& w : s.omega_rad_s) sum += magnitude(w);
    sum *= s.hub_moment_share;
    s.torque_B_N_m.x += c[0] * sum * s.v_air_B_m_s.y;
    s.torque_B_N_m.y -= c[1] * sum * s.v_air_B_m_s.x;
  }
};

}  // namespace rotorloop::host
