// Each rotor meets the air at its own place: v_i = v + share * (Ω x r_i) in eq. (1)-(2), where the paper takes the velocity of
// the centre of mass for all four. Damps roll and pitch. Physics says share = 1; the paper's model is share = 0.
#pragma once
#include "host/effects/term.hpp"

namespace rotorloop::host {

struct RotorLocalInflow {
  static constexpr std::string_view kId = "rotor_local_inflow";
  static constexpr TermParameter kParameters[] = {{"share", "1", 0.0, 1.3, 1.0, 0.0}};

  template <class S>
  static void inflow(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].v_air_B_m_s += scaled(c[0], cross(s.in.rates_B_rad_s, s.rotor[i].arm_B_m));
  }
};

}  // namespace rotorloop::host
