// One ESC's physical half: PWM compares in, ADC counts out, one PWM period per step. This is all the firmware ever touches;
// the emulated microcontroller and the native ESC drive the same object.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sim/drive/inverter.hpp"
#include "sim/drive/motor.hpp"
#include "sim/drive/sensing.hpp"

namespace rotorloop::sim {

struct DriveParameters {
  MotorParameters motor{};
  InverterParameters inverter{};
  SensingParameters sensing{};
  double blade_inertia_kg_m2 = 4.4e-6;  // three-blade 5-inch propeller
  double temperature_K = 308.15;        // board
};

// Compare values of centre-aligned PWM: the high side of a phase is on for compare/top of the period.
struct PwmCommand {
  std::array<std::uint16_t, 3> compare{};
  std::uint16_t top = 1;
  bool enabled = false;  // false: all six gates low
};

class Drive {
 public:
  Drive(const DriveParameters& parameters, RandomStream noise, double initial_angle_rad = 0.0);

  // Counts at the PWM centre between the period that just ended and the next one (all low sides on).
  AdcReading sample();
  // One PWM period; the command holds for all of it.
  void step(const PwmCommand& pwm);
  // The same for several drives and periods, up to four drives at a time side by side in vector registers. Every drive gets the
  // bits that step() gives it, in whatever company. drives[i] follows pwm[i] for all periods.
  static void step_together(std::span<Drive* const> drives, std::span<const PwmCommand> pwm, int periods);

  void set_bus_V(double bus_V) { bus_V_ = bus_V; }
  void set_load(const ShaftLoad& load) { load_ = load; }
  void set_temperature_K(double temperature_K) { temperature_K_ = temperature_K; }

  double bus_V() const { return bus_V_; }
  const ShaftLoad& load() const { return load_; }
  double omega_rad_s() const { return motor_.state().omega_rad_s; }
  PhaseCurrents phase_currents_A() const { return to_phases(motor_.current_A()); }
  double bus_energy_J() const { return bus_energy_J_; }  // taken from the bus since the start
  double time_in_step_s() const { return 1.0 / p_.inverter.pwm_Hz; }
  Motor& motor() { return motor_; }
  const Motor& motor() const { return motor_; }
  Sensing& sensing() { return sensing_; }

 private:
  template <class Real, std::size_t Count>
  static void step_driven(const std::array<Drive*, Count>& drives, const std::array<const PwmCommand*, Count>& pwm, int periods);
  bool driven(const PwmCommand& pwm) const { return pwm.enabled && bus_V_ > 0.0; }

  DriveParameters p_;
  Motor motor_;
  Sensing sensing_;
  ShaftLoad load_{};
  double bus_V_ = 0.0;
  double temperature_K_;
  double bus_energy_J_ = 0.0;
  std::array<double, 3> low_window_s_{};
};

}  // namespace rotorloop::sim
