// The induced velocity needs time to change, for it is carried by air that has mass: when a rotor speeds up, its thrust first
// overshoots. tau dv_i/dt = v_steady - v_i with the time constant of the apparent mass (Carpenter, Fridovich, NACA TN-3044, 1953),
//   tau = tau_factor 0.849 R / (2 (U + v_i dU/dv_i)),   U² = v_xy² + u²,   u = v_z + v_i,
// and the thrust of eq. (1) at the inflow of the moment instead of the steady one: T += k2 ω (v_i - v_steady).
// Memory: v_i - v_steady of each rotor.
#pragma once
#include "host/effects/thrust_lag.hpp"

namespace rotorloop::host {

struct DynamicInflow {
  static constexpr std::string_view kId = "dynamic_inflow";
  static constexpr TermParameter kParameters[] = {{"tau_factor", "1", 0.0, 5.0, 1e-1, 0.0}};
  static constexpr TermMemory kMemory[] = {{"behind_1", "m/s"}, {"behind_2", "m/s"}, {"behind_3", "m/s"}, {"behind_4", "m/s"}};

  template <class S>
  static void rotor(const S*, LoadState<S>& s, std::size_t i) {
    s.rotor[i].thrust_N += s.parameters.k2_N_s2_m * magnitude(s.omega_rad_s[i]) * s.memory[i];
  }

  static void advance(const double* c, const MemoryStep& step, double* memory) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const RotorLoad<double>&a = step.from.rotor[i], &b = step.to.rotor[i];
      const double u = a.through_m_s, across2 = a.v_air_B_m_s.x * a.v_air_B_m_s.x + a.v_air_B_m_s.y * a.v_air_B_m_s.y;
      const double speed = std::sqrt(across2 + u * u), induced = u - a.v_air_B_m_s.z;
      const double flow = speed + (speed > 0.0 ? induced * u / speed : 0.0);
      constexpr double kApparentMass = 0.849, kSlowest_m_s = 0.1;  // a rotor at rest has no wake to set moving
      const double tau_s = c[0] * kApparentMass * step.from.geometry.radius_m / (2.0 * std::max(flow, kSlowest_m_s));
      memory[i] = lag_behind(memory[i], induced, b.through_m_s - b.v_air_B_m_s.z, step.dt_s, tau_s);
    }
  }
};

}  // namespace rotorloop::host
