// Angular momentum of the rotors. A rotor that speeds up turns the body the other way; a body that turns tilts the momentum of its
// rotors. Two terms with the same parameter: the first needs the derivative of logged speeds, which a log may not carry well.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// τ = -Σ J_r ω̇_i s_i e_z, s_i = +1 for a rotor that turns counter-clockwise seen from above.
struct RotorInertiaReaction {
  static constexpr std::string_view kId = "rotor_inertia_reaction";
  static constexpr TermParameter kParameters[] = {{"J_r_kg_m2", "kg m2", 0.0, 1e-4, 1e-6, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    S spin_up{};
    for (std::size_t i = 0; i < kRotors; ++i) spin_up += spin(s, i) * s.omega_dot_rad_s2[i];
    s.torque_B_N_m.z -= c[0] * spin_up;
  }
};

// τ = -Ω x Σ J_r ω_i s_i e_z.
struct Gyroscopic {
  static constexpr std::string_view kId = "gyroscopic";
  static constexpr TermParameter kParameters[] = {{"J_r_kg_m2", "kg m2", 0.0, 1e-4, 1e-6, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    S momentum{};
    for (std::size_t i = 0; i < kRotors; ++i) momentum += spin(s, i) * s.omega_rad_s[i];
    const S h = c[0] * momentum;
    s.torque_B_N_m.x -= s.in.rates_B_rad_s.y * h;
    s.torque_B_N_m.y += s.in.rates_B_rad_s.x * h;
  }
};

}  // namespace rotorloop::host
