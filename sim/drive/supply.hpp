// One battery, one pair of leads, four ESCs: the leads' inductance and the capacitors of the ESCs make the bus a circuit of its
// own, which every ESC's current moves for all of them.
//   L di/dt = V_source - R i - v,   C dv/dt = i - sum of the ESCs' currents
#pragma once
#include <array>
#include <span>

#include "sim/drive/battery.hpp"

namespace rotorloop::sim {

struct CableParameters {
  double inductance_H = 0.30e-6;      // 2 x 15 cm of AWG 12, side by side (typical)
  double capacitance_F = 4 * 470e-6;  // one electrolytic capacitor per ESC
  double capacitor_ohm = 6e-3;        // their series resistance, all together
};

class Supply {
 public:
  static constexpr std::size_t kEscs = 4;

  Supply(const BatteryParameters& battery, const CableParameters& cable);
  // Mean bus currents of the ESCs over dt (one sample period of an ESC). Returns the bus voltage after it.
  double step(std::span<const double> currents_A, double dt_s);
  // Voltage above the mean that ESC `esc` samples in the middle of its own low sides: its pulses are off then, the others' are
  // where their phases (0..1 of a PWM period, in turns) put them. First harmonic of the two pulses per period.
  double ripple_V(std::size_t esc, std::span<const double> currents_A, std::span<const double> phase_turns, double pwm_Hz) const;

  double voltage_V() const { return bus_V_; }
  double cable_A() const { return cable_A_; }
  const Battery& battery() const { return battery_; }

 private:
  Battery battery_;
  BatteryParameters p_;
  CableParameters cable_;
  double cable_A_ = 0.0, capacitor_V_, bus_V_;
};

}  // namespace rotorloop::sim
