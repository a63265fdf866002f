// A load on a string below the body: a pendulum whose pivot is the hook. The string pulls the body along itself by
//   S = m M / (m + M) (L |ḋ|² - F·d / M),   d: unit vector from the hook to the load, F: all other forces but weight on the body,
// which is the tension that keeps both at distance L when the hook is at the centre of mass (Newton for both bodies along d); below
// zero the string is slack. The body's turning adds to the tension of a hook elsewhere; that is left out, the moment of S is not.
// Memory: x and y of d and ḋ in the world. They follow the hook's acceleration a_h, whatever the load weighs:
//   d̈ = (f - (f·d) d) / L - |ḋ|² d - 2 ζ sqrt(g / L) ḋ,   f = g - a_h - k |v| v,   v: velocity of the load over ground
// Good up to 70° from the vertical.
#pragma once
#include <array>

#include "host/effects/term.hpp"

namespace rotorloop::host {

struct SlungLoad {
  static constexpr std::string_view kId = "slung_load";
  // drag_1_m: drag of the load over its mass, ½ ρ c_d A / m. The hook's height counts from the geometric centre.
  static constexpr TermParameter kParameters[] = {{"mass_kg", "kg", 0.0, 0.3, 1e-2, 0.0},
                                                  {"length_m", "m", 0.05, 10.0, 1e-1, 0.5},
                                                  {"damping", "1", 0.0, 0.5, 2e-2, 0.02},
                                                  {"drag_1_m", "1/m", 0.0, 1.0, 2e-2, 0.0},
                                                  {"attach_z_m", "m", -0.3, 0.3, 1e-2, 0.0}};
  static constexpr TermMemory kMemory[] = {{{"start_d_x", "1", -0.9, 0.9, 0.02, 0.0}, 0.2},
                                           {{"start_d_y", "1", -0.9, 0.9, 0.02, 0.0}, 0.2},
                                           {{"start_rate_x", "1/s", -10.0, 10.0, 0.1, 0.0}, 1.0},
                                           {{"start_rate_y", "1/s", -10.0, 10.0, 0.1, 0.0}, 1.0}};
  static constexpr TermTraits kTraits{.mass_beside_body = true, .memory_is_swing = true};

  // Swings from 0.29 to 1.6 Hz, free, dragged through the air, and damped.
  static constexpr std::array<double, 180> kScan = [] {
    std::array<double, 180> rows{};
    std::size_t at = 0;
    for (const double length_m : {0.1, 0.15, 0.2, 0.27, 0.35, 0.45, 0.55, 0.7, 0.9, 1.2, 1.8, 3.0}) {
      for (const auto& [damping, drag_1_m] : {std::array{0.02, 0.0}, std::array{0.02, 0.02}, std::array{0.15, 0.0}}) {
        for (const double x : {0.0, length_m, damping, drag_1_m, 0.0}) rows[at++] = x;
      }
    }
    return rows;
  }();

  template <class S>
  static void body(const S* c, LoadState<S>& s) {
    const S *m = s.memory, z = -square_root(1.0 - m[0] * m[0] - m[1] * m[1]), rate_z = -(m[0] * m[2] + m[1] * m[3]) / z;
    const S swing2 = m[2] * m[2] + m[3] * m[3] + rate_z * rate_z;
    const Vec3<S> d = scaled(m[0], s.in.world_B[0]) + scaled(m[1], s.in.world_B[1]) + scaled(z, s.in.world_B[2]);
    const double M = s.geometry.mass_kg;
    const S apart = M * c[1] * swing2 - dot(s.force_B_N, d);
    if (value_of(apart) <= 0.0) return;  // slack; not asked of the tension, whose slope by a mass of zero must stay
    const Vec3<S> pull = scaled(c[0] * apart / (c[0] + M), d);
    const Vec3<S> arm{-s.parameters.com_x_m, -s.parameters.com_y_m, c[4] - s.geometry.com_z_m};
    s.torque_B_N_m += cross(arm, pull);
    s.force_B_N += pull;
  }

  static void advance(const double* c, const MemoryStep& step, double* memory);
};

}  // namespace rotorloop::host
