// Aerodynamic torque that is not c_q ω²: it follows the power that the rotor puts into the air, another law of speed, or differs
// between rotors.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// Torque from power: Q = Q_0 (1 + 4.5 μ²) + T (v_z + v_i) / ω, μ = v_xy / (ω R), with the profile part Q_0 such that still air gives
// c_q ω² (Bramwell, Helicopter Dynamics). The power of the force in the disk plane is left out: eq. (4) holds a force that the body raises,
// and it would turn the sign of the whole. Physics says share = 1; eq. (3) is share = 0. In level flight the rotors' changes nearly cancel;
// climb and descent show it.
struct TorqueAdvance {
  static constexpr std::string_view kId = "torque_advance";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 2.0, 1.0, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S speed = magnitude(s.omega_rad_s[i]);
    if (value_of(speed) < kStopped_rad_s) return;
    RotorLoad<S>& r = s.rotor[i];
    const double q = momentum_kg_m(s.geometry), R2 = s.geometry.radius_m * s.geometry.radius_m;
    const S flow = still_flow_m(s), induced = q * flow * flow * flow;  // torque of the induced power in still air over ω²
    const S profile = (s.parameters.c_q_N_m_s2 - induced) * (4.5 / R2) * across2(r.v_air_B_m_s);
    r.torque_N_m += c[0] * (profile + r.thrust_N * r.through_m_s / speed - induced * speed * speed);
  }
};

// Q += k_q ω (flow through the disk less that in still air): the induced power T u / ω with a free coefficient.
struct InflowTorque {
  static constexpr std::string_view kId = "inflow_torque";
  static constexpr TermParameter kParameters[] = {{"k_q_N_s2", "N s2", 0.0, 2e-5, 1e-6, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S speed = magnitude(s.omega_rad_s[i]);
    s.rotor[i].torque_N_m += c[0] * speed * (s.rotor[i].through_m_s - still_flow_m(s) * speed);
  }
};

// Q *= (ω / ω_0)^exponent, ω_0 the speed that carries the nominal weight in still air.
struct TorqueSpeedExponent {
  static constexpr std::string_view kId = "torque_speed_exponent";
  static constexpr TermParameter kParameters[] = {{"exponent", "1", -0.5, 0.5, 0.05, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    const S speed = magnitude(s.omega_rad_s[i]);
    if (value_of(speed) < kStopped_rad_s) return;
    s.rotor[i].torque_N_m *= power(speed / hover_speed_rad_s(s), c[0]);
  }
};

// Q_i *= 1 + ε_i (rotor_groups.hpp).
struct RotorTorqueScale {
  static constexpr std::string_view kId = "rotor_torque_scale";
  static constexpr TermTraits kTraits{.common_part = "c_q"};
  static constexpr TermParameter kParameters[] = {{"epsilon_1", "1", -0.3, 0.3, 0.1, 0.0},
                                                  {"epsilon_2", "1", -0.3, 0.3, 0.1, 0.0},
                                                  {"epsilon_3", "1", -0.3, 0.3, 0.1, 0.0},
                                                  {"epsilon_4", "1", -0.3, 0.3, 0.1, 0.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].torque_N_m *= 1.0 + c[i];
  }
};

}  // namespace rotorloop::host
