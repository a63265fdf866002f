// A rotor that speeds up turns the body the other way, and a body that turns tilts the rotors' angular momentum:
//   τ = -Σ J_r ω̇_i s_i e_z - Ω x Σ J_r ω_i s_i e_z,   s_i = +1 for a rotor that turns counter-clockwise seen from above,
// which is -reaction: the air drags such a rotor, and through it the body, clockwise. Needs ω̇ of the log.
#pragma once
#include "host/effects/term.hpp"

namespace rotorloop::host {

struct RotorInertiaReaction {
  static constexpr std::string_view kId = "rotor_inertia_reaction";
  static constexpr TermParameter kParameters[] = {{"J_r_kg_m2", "kg m2", 0.0, 1e-3, 1e-6, 0.0}};

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    S spin_up{}, momentum{};
    for (std::size_t i = 0; i < kRotors; ++i) {
      const double turns = -s.geometry.rotors[i].reaction;
      spin_up += turns * s.omega_dot_rad_s2[i];
      momentum += turns * s.omega_rad_s[i];
    }
    s.torque_B_N_m.z -= c[0] * spin_up;
    const S h = c[0] * momentum;
    s.torque_B_N_m.x -= s.in.rates_B_rad_s.y * h;
    s.torque_B_N_m.y += s.in.rates_B_rad_s.x * h;
  }
};

}  // namespace rotorloop::host
