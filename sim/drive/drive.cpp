#include "sim/drive/drive.hpp"

namespace rotorloop::sim {

Drive::Drive(const DriveParameters& parameters, RandomStream noise, double initial_angle_rad)
    : p_(parameters),
      motor_(parameters.motor, parameters.motor.inertia_kg_m2 + parameters.blade_inertia_kg_m2, initial_angle_rad),
      sensing_(parameters.sensing, noise),
      temperature_K_(parameters.temperature_K) {}

AdcReading Drive::sample() { return sensing_.sample(phase_currents_A(), low_window_s_, bus_V_, temperature_K_); }

void Drive::step(const PwmCommand& pwm) {
  const double period_s = 1.0 / p_.inverter.pwm_Hz;
  if (!pwm.enabled || bus_V_ <= 0.0) {
    bus_energy_J_ += motor_.step_open(bus_V_ > 0.0 ? bus_V_ : 0.5, load_, period_s);
    low_window_s_ = {};
    return;
  }
  std::array<double, 3> duty{};
  const double over_top = 1.0 / pwm.top;
  for (std::size_t k = 0; k < 3; ++k) {
    duty[k] = pwm.compare[k] >= pwm.top ? 1.0 : pwm.compare[k] * over_top;
    low_window_s_[k] = 0.5 * ((1.0 - duty[k]) * period_s - p_.inverter.dead_time_s);
  }
  const BridgeOutput out = bridge_output(p_.inverter, duty, phase_currents_A(), bus_V_);
  bus_energy_J_ += motor_.step_driven(out.v_V, p_.inverter.switch_resistance_ohm, load_, period_s) + out.diode_loss_W * period_s;
}

}  // namespace rotorloop::sim
