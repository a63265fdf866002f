// The shipped tri-blade and conditions shared by the rotor tests.
#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

#include "host/base/random.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::sim::test {

constexpr double kHoverThrust_N = 1.672;  // 0.682 kg on four rotors
constexpr double kDensity = 1.2;
constexpr double kRpm = std::numbers::pi / 30.0;

inline const Blade& triblade() {
  static const Blade blade = read_blade(ROTORLOOP_SOURCE_DIR "/vehicles/blades/triblade_5in.toml");
  return blade;
}
inline const Rotor& rotor() {
  static const Rotor r(triblade());
  return r;
}
inline const Rotor& reference_rotor() {
  static const Rotor r(triblade(), {64, 128});
  return r;
}
inline RotorLoads solve_cold(const Rotor& r, const RotorCondition& c) {
  RotorWarmStart cold;
  return solve_rotor(r, c, cold);
}
inline RotorCondition at(double vx, double vy, double vz, double omega, int spin = 1) {
  RotorCondition c;
  c.v_R_m_s = {vx, vy, vz};
  c.omega_rad_s = omega;
  c.spin = spin;
  c.density_kg_m3 = kDensity;
  return c;
}
// Speed that carries the reference vehicle's weight.
inline double hover_omega() {
  static const double omega = [] {
    double low = 300.0, high = 2500.0;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      (solve_cold(rotor(), at(0, 0, 0, middle)).force_R_N.z() < kHoverThrust_N ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }();
  return omega;
}
// A flight that weaves between hover and 12 m/s with climbs to 3.5 m/s, turns and changing rotor speed; 1 kHz.
inline RotorCondition flight_state(int step) {
  const double t = step * 1e-3;
  RotorCondition c = at(6.0 + 6.0 * std::sin(0.9 * t), 3.0 * std::sin(0.7 * t + 1.0), 3.5 * std::sin(1.3 * t),
                        980.0 + 150.0 * std::sin(5.0 * t) + 30.0 * std::sin(37.0 * t));
  c.w_R_rad_s = {3.0 * std::sin(4.1 * t), 6.5 * std::sin(3.3 * t), 2.0 * std::sin(2.0 * t)};
  return c;
}

// Speeds up to v_max along each axis, either spin.
inline RotorCondition random_condition(std::uint64_t i, double v_max, double omega_min, double omega_max, double rate_max) {
  static const RandomStream stream(7, 1);
  const auto u = [&](std::uint64_t k) { return 2.0 * stream.uniform(16 * i + k) - 1.0; };
  RotorCondition c =
      at(v_max * u(0), v_max * u(1), v_max * u(2), omega_min + (omega_max - omega_min) * stream.uniform(16 * i + 3), u(4) < 0 ? -1 : 1);
  c.w_R_rad_s = {rate_max * u(5), rate_max * u(6), rate_max * u(7)};
  return c;
}

}  // namespace rotorloop::sim::test
