// A rotor's thrust and torque come late behind its speed: the air has to be set moving, and coarse models of the drive hide here too.
// Each follows the load of the steady rotor with the time constant tau. Memory: how far the square of the speed that the loads
// feel is from that of the speed, rotor by rotor; what changes the load beside the speed (climb, wind) is taken as felt at once.
// The reaction to the rotor's acceleration does not lag: yaw tells this term from a late speed signal.
#pragma once
#include "host/base/elementary.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::host {

// y that follows u with the time constant tau, where u runs straight from u0 to u1 in dt: y1 - u1 from y0 - u0, exactly.
inline double lag_behind(double behind, double u0, double u1, double dt_s, double tau_s) {
  if (!(tau_s > 1e-9)) return 0.0;
  const double slope = (u1 - u0) / dt_s, decay = exp_exact(-std::min(dt_s / tau_s, 700.0));
  return decay * behind - (1.0 - decay) * tau_s * slope;
}

struct ThrustLag {
  static constexpr std::string_view kId = "thrust_lag";
  static constexpr TermParameter kParameters[] = {{"tau_s", "s", 0.0, 0.05, 1e-3, 0.0}};
  static constexpr TermMemory kMemory[] = {
      {"lead_1", "rad2/s2"}, {"lead_2", "rad2/s2"}, {"lead_3", "rad2/s2"}, {"lead_4", "rad2/s2"}};

  template <class S>
  static void rotor(const S*, LoadState<S>& s, std::size_t i) {
    const S speed2 = s.omega_rad_s[i] * s.omega_rad_s[i];
    if (value_of(speed2) < 1.0) return;
    const S share = 1.0 + s.memory[i] / speed2;
    s.rotor[i].thrust_N = s.rotor[i].thrust_N * share;
    s.rotor[i].torque_N_m = s.rotor[i].torque_N_m * share;
  }

  static void advance(const double* c, const MemoryStep& step, double* memory) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const double from = step.from.omega_rad_s[i], to = step.to.omega_rad_s[i];
      memory[i] = lag_behind(memory[i], from * from, to * to, step.dt_s, c[0]);
    }
  }
};

}  // namespace rotorloop::host
