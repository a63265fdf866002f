// One ESC's physical half: PWM compares in, ADC counts out, one PWM period per step. This is all the firmware ever touches;
// the emulated microcontroller and the native ESC drive the same object.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/drive/drive_fault.hpp"
#include "sim/drive/inverter.hpp"
#include "sim/drive/motor.hpp"
#include "sim/drive/sensing.hpp"
#include "sim/drive/switched_bridge.hpp"
#include "sim/drive/thermal.hpp"

namespace rotorloop::sim {

struct DriveParameters {
  MotorParameters motor{};
  InverterParameters inverter{};
  SensingParameters sensing{};
  double blade_inertia_kg_m2 = 4.4e-6;  // three-blade 5-inch propeller
  double temperature_K = 308.15;        // board
  ThermalParameters thermal{};
  std::vector<DriveFault> faults;    // by the drive's own time
  double switched_step_s = 0.25e-6;  // longest one while a leg is broken (switched_bridge.hpp); studies of many faults take longer ones
};

// Compare values of centre-aligned PWM: the high side of a phase is on for compare/top of the period.
struct PwmCommand {
  std::array<std::uint16_t, 3> compare{};
  std::uint16_t top = 1;
  bool enabled = false;            // false: all six gates low
  std::uint8_t gates = kAllGates;  // those that follow the compares; the others stay low
};

class Drive {
 public:
  Drive(const DriveParameters& parameters, RandomStream noise, double initial_angle_rad = 0.0);

  // Counts at the PWM centre between the period that just ended and the next one (all low sides on).
  AdcReading sample();
  // The shunt amplifiers' counts half a period earlier, at the middle of the high sides' time.
  std::array<std::uint16_t, 3> sample_unloaded();
  // One PWM period; the command holds for all of it.
  void step(const PwmCommand& pwm);
  // The same for several drives and periods, up to four drives at a time side by side in vector registers. Every drive gets the
  // bits that step() gives it, in whatever company. drives[i] follows pwm[i] for all periods.
  static void step_together(std::span<Drive* const> drives, std::span<const PwmCommand> pwm, int periods);

  void set_bus_V(double bus_V) { bus_V_ = bus_V; }
  void set_load(const ShaftLoad& load) { load_ = load; }
  void set_temperature_K(double temperature_K) { temperatures_.board_K = temperature_K; }
  void set_bus_ripple_V(double ripple_V) { bus_ripple_V_ = ripple_V; }  // above the mean at the sampling instant
  void add_fault(const DriveFault& fault) { p_.faults.push_back(fault); }

  double bus_V() const { return bus_V_; }
  const ShaftLoad& load() const { return load_; }
  double omega_rad_s() const { return motor_.state().omega_rad_s; }
  PhaseCurrents phase_currents_A() const { return to_phases(motor_.current_A()); }
  double bus_energy_J() const { return bus_energy_J_; }  // taken from the bus since the start
  double shorted_s() const { return shorted_s_; }        // of it, both FETs of a leg conducting
  const Temperatures& temperatures() const { return temperatures_; }
  double time_s() const { return static_cast<double>(pwm_periods_) / p_.inverter.pwm_Hz; }
  const DriveParameters& parameters() const { return p_; }
  double time_in_step_s() const { return 1.0 / p_.inverter.pwm_Hz; }
  Motor& motor() { return motor_; }
  const Motor& motor() const { return motor_; }
  Sensing& sensing() { return sensing_; }

 private:
  // What a step needs of one drive or of four, and what it changes.
  template <class Real>
  struct SideBySide {
    Real period_s, dead_time_s, energy_J;
    MotorConstants<Real> motor;
    BridgeConstants<Real> bridge;
    BasicShaftLoad<Real> load;
    std::array<Real, 3> duty;
    BasicMotorState<Real> state;
  };
  template <class Real, std::size_t Count>
  static SideBySide<Real> gather(const std::array<Drive*, Count>& drives, const std::array<const PwmCommand*, Count>& pwm);
  template <class Real, std::size_t Count>
  static void scatter(const std::array<Drive*, Count>& drives, const SideBySide<Real>& stepped, int periods);
  // kDetailed: edges by the charge of the node, true ripple, iron that saturates.
  template <bool kDetailed, class Real, std::size_t Count>
  static void step_driven(const std::array<Drive*, Count>& drives, const std::array<const PwmCommand*, Count>& pwm, int periods);
  bool driven(const PwmCommand& pwm) const { return pwm.enabled && bus_V_ > 0.0; }
  // No average over a period knows a broken leg, nor one of which a gate is left out.
  bool edge_by_edge(const PwmCommand& pwm) const { return legs_.any || (driven(pwm) && pwm.gates != kAllGates); }
  // All gates low, no channel shorted, the currents gone: broken legs or not, nothing switches.
  bool at_rest(const PwmCommand& pwm) const;
  bool detailed() const { return p_.inverter.node_capacitance_F > 0.0; }
  void step_alone(const PwmCommand& pwm, int periods);
  void step_off();  // all gates low
  void step_switched(const PwmCommand& pwm);
  // What changes slowly: temperatures, drift of offsets, faults that begin or end. Once a millisecond.
  void count_periods(int periods);
  std::int64_t slow_periods() const;
  bool slow_within(int periods) const { return pwm_periods_ + periods > next_slow_; }  // before their end
  void follow_losses(double dt_s);
  void follow_faults();
  MotorConstants<double> present_motor() const;
  ShaftLoad present_load() const;

  DriveParameters p_;
  Motor motor_;
  Sensing sensing_;
  ShaftLoad load_{};
  double bus_V_ = 0.0, bus_ripple_V_ = 0.0;
  double bus_energy_J_ = 0.0, shorted_s_ = 0.0;
  std::array<double, 3> low_window_s_{};
  Temperatures temperatures_{};
  double copper_ = 1.0, channel_ = 1.0, flux_ = 1.0;  // over the values at 25 degC; flux with the magnets' damage
  double load_share_ = 1.0, strike_N_m_ = 0.0;
  bool locked_ = false;
  SwitchedBridge bridge_;
  LegFaults legs_{};
  std::array<double, 3> low_current_A_{};  // of the last period stepped edge by edge …
  bool by_edges_ = false;                  // … if it was
  std::int64_t pwm_periods_ = 0, next_slow_ = 0;
};

}  // namespace rotorloop::sim
