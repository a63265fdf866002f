#include "bench/hil/esc_lab/best_step.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::esc_lab {
namespace {

// Phase voltage amplitude over supply: 1/sqrt 3 of space vector modulation less 8 % for sampling windows and dead times.
constexpr double kModulation = 0.577 * 0.92;

struct Machine {
  double resistance_ohm, inductance_H, flux_Wb, pole_pairs, torque_per_A, friction_N_m, load_N_m_s2, inertia_kg_m2, limit_A, bus_limit_A,
      bus_V;
};

Machine machine(const EscDraw& d) {
  const sim::MotorParameters& m = d.drive.motor;
  return {m.resistance_ohm + d.drive.inverter.switch_resistance_ohm,
          0.5 * (m.inductance_H.d + m.inductance_H.q),
          m.flux_linkage_Wb,
          static_cast<double>(m.pole_pairs),
          1.5 * m.pole_pairs * m.flux_linkage_Wb,
          m.static_friction_N_m,
          d.load_N_m_s2,
          m.inertia_kg_m2 + d.drive.blade_inertia_kg_m2,
          static_cast<double>(d.firmware.phase_current_limit_A),
          static_cast<double>(d.firmware.bus_current_limit_A),
          d.bus_V};
}

double voltage_V(const Machine& m, double w, double i_A) {
  const double w_e = w * m.pole_pairs;
  return std::hypot(w_e * m.flux_Wb + m.resistance_ohm * i_A, w_e * m.inductance_H * i_A);
}

double power_W(const Machine& m, double w, double i_A) { return 1.5 * i_A * (w * m.pole_pairs * m.flux_Wb + m.resistance_ohm * i_A); }

bool allowed(const Machine& m, double w, double i_A) {
  return voltage_V(m, w, i_A) <= kModulation * m.bus_V && power_W(m, w, i_A) <= m.bus_limit_A * m.bus_V;
}

double most_driving_A(const Machine& m, double w) {
  double low = 0.0, high = m.limit_A;
  if (allowed(m, w, high)) return high;
  for (int k = 0; k < 40; ++k) (allowed(m, w, 0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

}  // namespace

double highest_speed_rad_s(const EscDraw& d) {
  const Machine m = machine(d);
  double low = 0.0, high = static_cast<double>(d.firmware.max_speed_rad_s);
  const auto holds = [&](double w) {
    const double i_A = (m.load_N_m_s2 * w * w + m.friction_N_m) / m.torque_per_A;
    return i_A <= 0.9 * m.limit_A && allowed(m, w, i_A);
  };
  if (holds(high)) return high;
  for (int k = 0; k < 40; ++k) (holds(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

BestStep best_step(const EscDraw& d, double from, double to) {
  const Machine m = machine(d);
  constexpr double kDt_s = 20e-6;
  BestStep b;
  double w = from, t_s = 0.0, t10_s = -1.0, t90_s = -1.0;
  for (; t_s < 5.0; t_s += kDt_s) {
    const double x = (w - from) / (to - from);
    if (t10_s < 0.0 && x >= 0.1) t10_s = t_s;
    if (t90_s < 0.0 && x >= 0.9) t90_s = t_s;
    if (x >= 0.98) break;
    const double i_A = to > from ? most_driving_A(m, w) : -m.limit_A;
    w += kDt_s / m.inertia_kg_m2 * (m.torque_per_A * i_A - m.load_N_m_s2 * w * w - m.friction_N_m);
  }
  b.rise_ms = 1e3 * (t90_s - t10_s);
  b.reach_ms = 1e3 * t_s;
  return b;
}

}  // namespace rotorloop::esc_lab
