#include "sim/drive/supply.hpp"

#include <cmath>

#include "host/base/elementary.hpp"

namespace rotorloop::sim {

Supply::Supply(const BatteryParameters& battery, const CableParameters& cable)
    : battery_(battery), p_(battery), cable_(cable), capacitor_V_(battery_.voltage_V()), bus_V_(capacitor_V_) {}

double Supply::step(std::span<const double> currents_A, double dt_s) {
  double load_A = 0.0;
  for (const double i : currents_A) load_A += i;
  // Backward Euler for both states at once: the resonance near 7 kHz is damped too much rather than excited by the step.
  const double r = p_.resistance_ohm + cable_.capacitor_ohm, a = dt_s / cable_.inductance_H, b = dt_s / cable_.capacitance_F;
  const double source_V = battery_.rest_V() + cable_.capacitor_ohm * load_A;
  double cable_A = (cable_A_ + a * (source_V - capacitor_V_ + b * load_A)) / (1.0 + a * (r + b));
  if (!p_.can_sink && cable_A < 0.0) cable_A = 0.0;
  capacitor_V_ += b * (cable_A - load_A);
  cable_A_ = cable_A;
  bus_V_ = capacitor_V_ + cable_.capacitor_ohm * (cable_A - load_A);
  battery_.step(cable_A, dt_s);
  return bus_V_;
}

double Supply::ripple_V(std::size_t esc, std::span<const double> currents_A, std::span<const double> phase_turns, double pwm_Hz) const {
  // Two pulses of a share of the period each: half of the charge swing over C, and the series resistance, by the mean current.
  const double per_A = cable_.capacitor_ohm + 0.0625 / (pwm_Hz * cable_.capacitance_F);
  double sum_V = 0.0;
  for (std::size_t j = 0; j < currents_A.size(); ++j)
    sum_V += per_A * currents_A[j] * cos_exact(4.0 * 3.14159265358979323846 * (phase_turns[j] - phase_turns[esc]));
  return sum_V;
}

}  // namespace rotorloop::sim
