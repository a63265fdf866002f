// The air around the vehicle: it moves, it moves differently at different heights, it is thinner or denser than nominal.
#pragma once
#include "host/effects/term_math.hpp"

namespace rotorloop::host {

// v_air = v - w, w constant in the world.
struct WindSteady {
  static constexpr std::string_view kId = "wind_steady";
  static constexpr TermParameter kParameters[] = {
      {"w_x_m_s", "m/s", -20.0, 20.0, 1.0, 0.0}, {"w_y_m_s", "m/s", -20.0, 20.0, 1.0, 0.0}, {"w_z_m_s", "m/s", -10.0, 10.0, 1.0, 0.0}};
  static constexpr TermTraits kTraits{.mean_wind = true};

  template <class S>
  static void air(const S* c, LoadState<S>& s) {
    for (std::size_t k = 0; k < 3; ++k) s.v_air_B_m_s -= scaled(c[k], s.in.world_B[k]);
  }
};

// w = z (g_x, g_y, 0). Wind at z = 0 of the log is wind_steady's affair.
struct WindShear {
  static constexpr std::string_view kId = "wind_shear";
  static constexpr TermParameter kParameters[] = {{"gradient_x_1_s", "1/s", -5.0, 5.0, 0.5, 0.0},
                                                  {"gradient_y_1_s", "1/s", -5.0, 5.0, 0.5, 0.0}};

  template <class S>
  static void air(const S* c, LoadState<S>& s) {
    for (std::size_t k = 0; k < 2; ++k) s.v_air_B_m_s -= scaled(c[k] * s.in.p_W_m.z, s.in.world_B[k]);
  }
};

// Thrust, torque and drag of rotors and body in proportion to the density at the same speeds: k1, k2 and 2ρA of eq. (1)-(2) scale
// alike, so thrust does exactly.
struct AirDensity {
  static constexpr std::string_view kId = "air_density";
  static constexpr TermParameter kParameters[] = {{"ratio", "1", 0.6, 1.3, 0.05, 1.0}};

  template <class S>
  static void rotor(const S* c, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N *= c[0];
    s.rotor[i].torque_N_m *= c[0];
    s.rotor[i].drag_N_s_m *= c[0];
  }
  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    s.force_B_N += scaled(c[0] - 1.0, airframe_drag(s));
  }
};

}  // namespace rotorloop::host
