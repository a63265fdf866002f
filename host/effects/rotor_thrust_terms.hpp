// Thrust that is not what eq. (1)-(2) say of this rotor speed: another coefficient, one rotor alone, another law, or late.
#pragma once
#include "host/effects/flight_time.hpp"
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

struct ThrustScale {
  static constexpr std::string_view kId = "thrust_scale";
  static constexpr TermParameter kParameters[] = {{"scale", "1", 0.7, 1.3, 0.05, 1.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= c[0];
  }
};

struct BlockageStrut {
  static constexpr std::string_view kId = "blockage_strut";
  static constexpr TermParameter kParameters[] = {{"loss", "1", 0.0, 0.3, 0.08, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= 1.0 - c[0];
  }
};

// T *= (ω / ω_0)^exponent, ω_0 the speed that carries the nominal weight in still air.
struct ThrustSpeedExponent {
  static constexpr std::string_view kId = "thrust_speed_exponent";
  static constexpr TermParameter kParameters[] = {{"exponent", "1", -0.5, 0.5, 0.05, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S speed = magnitude(s.omega_rad_s[i]);
    if (value_of(speed) < kStopped_rad_s) return;
    s.rotor[i].thrust_N *= power(speed / hover_speed_rad_s(s), c[0]);
  }
};

// T_i += k_3 |ω_i|³: the thrust coefficient rises in proportion to rotor speed. Unlike thrust_speed_exponent it acts on the static part
// alone, and beyond the speeds that were flown it goes on growing.
struct ThrustSpeedCubed {
  static constexpr std::string_view kId = "thrust_speed_cubed";
  static constexpr TermParameter kParameters[] = {{"k3_N_s3", "N s3", -1e-9, 1e-9, 5e-11, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S speed = magnitude(s.omega_rad_s[i]);
    s.rotor[i].thrust_N += c[0] * speed * speed * speed;
  }
};

// T_i += k v_xy³ / ω: what a blade gains at a high advance ratio beyond eq. (2), whose translational lift grows ever more slowly.
struct HighAdvanceThrust {
  static constexpr std::string_view kId = "high_advance_thrust";
  static constexpr TermParameter kParameters[] = {{"k_N_s2_m3", "N s2/m3", -1.0, 1.0, 0.05, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S speed = magnitude(s.omega_rad_s[i]);
    if (value_of(speed) < kStopped_rad_s) return;
    const S edgewise2 = across2(s.rotor[i].v_air_B_m_s);
    s.rotor[i].thrust_N += c[0] * edgewise2 * square_root(edgewise2 + 1e-12) / speed;
  }
};

// T_i *= 1 + ε_i (rotor_groups.hpp).
struct WeakRotor {
  static constexpr std::string_view kId = "weak_rotor";
  static constexpr TermTraits kTraits{.common_part = "k_1 and k_2"};
  static constexpr TermParameter kParameters[] = {{"epsilon_1", "1", -0.5, 0.1, 0.05, 0.0},
                                                  {"epsilon_2", "1", -0.5, 0.1, 0.05, 0.0},
                                                  {"epsilon_3", "1", -0.5, 0.1, 0.05, 0.0},
                                                  {"epsilon_4", "1", -0.5, 0.1, 0.05, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= 1.0 + c[i];
  }
};

// T *= 1 + rate t, t since the start of the flight: ice or dirt on all blades, or a coefficient that a rotor loses as it warms.
struct ThrustDrift : FlightTime {
  static constexpr std::string_view kId = "thrust_drift";
  static constexpr TermParameter kParameters[] = {{"rate_1_s", "1/s", -0.02, 0.02, 1.5e-3, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= share_in_time(c[0], s.memory[0]);
  }
};

// T_i *= 1 + rate_i t: one rotor fades in flight. All four alike are thrust_drift, which is the simpler law; no number of the model drifts,
// so their common part is their own.
struct RotorThrustDrift : FlightTime {
  static constexpr std::string_view kId = "rotor_thrust_drift";
  static constexpr TermParameter kParameters[] = {{"rate_1", "1/s", -0.02, 0.02, 1.5e-3, 0.0},
                                                  {"rate_2", "1/s", -0.02, 0.02, 1.5e-3, 0.0},
                                                  {"rate_3", "1/s", -0.02, 0.02, 1.5e-3, 0.0},
                                                  {"rate_4", "1/s", -0.02, 0.02, 1.5e-3, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= share_in_time(c[i], s.memory[0]);
  }
};

// First order in the lag: T - τ dT/dt, with dT/dt by the change of rotor speed alone; torque alike.
struct ThrustLag {
  static constexpr std::string_view kId = "thrust_lag";
  static constexpr TermParameter kParameters[] = {{"tau_s", "s", 0.0, 0.05, 0.01, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    if (value_of(magnitude(s.omega_rad_s[i])) < kStopped_rad_s) return;
    const S late = 2.0 * c[0] * s.omega_dot_rad_s2[i] / s.omega_rad_s[i];
    r.thrust_N -= late * r.thrust_N;
    r.torque_N_m -= late * r.torque_N_m;
  }
};

// The induced velocity follows with τ = factor 0.849 R / (2 (U + v_i dU/dv_i)) (Carpenter, Fridovich 1953); until it has, the blades
// thrust by -k2 ω τ dv_i/dt more, with dv_i/dt = v_i ω̇ / ω.
struct DynamicInflow {
  static constexpr std::string_view kId = "dynamic_inflow";
  static constexpr TermParameter kParameters[] = {{"tau_factor", "1", 0.0, 5.0, 1.0, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    RotorLoad<S>& r = s.rotor[i];
    const S induced = r.through_m_s - r.v_air_B_m_s.z;
    const S flow = square_root(across2(r.v_air_B_m_s) + squared(r.through_m_s) + 1e-6);
    const S slowness = 2.0 * (flow + induced * r.through_m_s / flow);
    if (value_of(slowness) < 0.1) return;  // m/s: the flow turns round, the law has no meaning
    const S tau = c[0] * (0.849 * s.geometry.radius_m) / slowness;
    r.thrust_N -= s.parameters.k2_N_s2_m * tau * induced * s.omega_dot_rad_s2[i];
  }
};

}  // namespace rotorloop::host
