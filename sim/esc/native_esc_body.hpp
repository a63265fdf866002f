// Bodies of native_esc.hpp, for the files that instantiate it for one board each (they compile side by side).
#pragma once
#include <algorithm>
#include <array>

#include "sim/esc/drawn_drive.hpp"
#include "sim/esc/native_esc.hpp"

namespace rotorloop::sim {

template <class Scales>
BasicNativeEsc<Scales>::BasicNativeEsc(const NativeEscConfig& c)
    : drive_(with_clock(drawn_drive(c, stage()), c.own_clock), esc_stream(c, kNoiseStream), initial_angle_rad(c)),
      board_(),
      control_(c.firmware) {
  if (c.typical_board && c.own_clock) {
    const TypicalDrive t = drawn_drive(c, stage());
    rate_ = 1.0 + 1e-6 * t.clock_ppm;
    phase_ = t.pwm_phase;
  }
  drive_.set_bus_V(c.bus_V);
}

template <class Scales>
int BasicNativeEsc<Scales>::periods_due() {
  phase_ += rate_ - 1.0;
  if (phase_ >= 1.0) return phase_ -= 1.0, 2;
  if (phase_ < 0.0) return phase_ += 1.0, 0;
  return 1;
}

template <class Scales>
PwmCommand BasicNativeEsc<Scales>::run_firmware() {
  // The compares written in the previous interrupt take effect at this instant.
  active_ = board_.compare;
  const AdcReading adc = drive_.sample();
  board_.counts = {adc.phase, adc.bus, adc.temperature};
  board_.unloaded = drive_.sample_unloaded();
  board_.now_us = static_cast<std::uint64_t>(time_us());
  control_.set_setpoint(setpoint_);
  if (!instead_of_firmware_ || !instead_of_firmware_(board_)) control_.on_sample(board_);
  return {active_.phase, static_cast<std::uint16_t>(Board::kPwmTop), board_.bridge, board_.gates};
}

template <class Scales>
void BasicNativeEsc<Scales>::step_current_loop() {
  BasicNativeEsc* const alone = this;
  step_current_loops({&alone, 1});
}

template <class Scales>
void BasicNativeEsc<Scales>::step_current_loops(std::span<BasicNativeEsc* const> escs) {
  std::array<Drive*, Lanes::kCount> drives;
  std::array<PwmCommand, Lanes::kCount> pwm;
  while (!escs.empty()) {
    const std::size_t most = std::min(escs.size(), Lanes::kCount);
    std::size_t n = 0;
    for (BasicNativeEsc* esc : escs.first(most)) {
      const int due = esc->periods_due();
      if (due == 0) continue;
      if (due == 2) {  // one more than the others: alone
        drives[n] = &esc->drive_;
        pwm[n] = esc->run_firmware();
        Drive::step_together({&drives[n], 1}, {&pwm[n], 1}, static_cast<int>(Board::kPwmPeriodsPerSample));
        ++esc->periods_;
      }
      drives[n] = &esc->drive_;
      pwm[n++] = esc->run_firmware();
      ++esc->periods_;
    }
    Drive::step_together({drives.data(), n}, {pwm.data(), n}, static_cast<int>(Board::kPwmPeriodsPerSample));
    escs = escs.subspan(most);
  }
}

template <class Scales>
void BasicNativeEsc<Scales>::couple(double load_torque_N_m, double bus_V) {
  couple_quadratic(load_coefficient_N_m_s2(load_torque_N_m, drive_.omega_rad_s()), bus_V);
}

template <class Scales>
void BasicNativeEsc<Scales>::couple_quadratic(double load_N_m_s2, double bus_V) {
  drive_.set_load({load_N_m_s2, 0.0});
  drive_.set_bus_V(bus_V);
  coupled_omega_rad_s_ = drive_.omega_rad_s();
  coupled_energy_J_ = drive_.bus_energy_J();
  coupled_period_ = periods_;
}

template <class Scales>
double BasicNativeEsc<Scales>::shaft_acceleration_rad_s2() const {
  const auto n = periods_ - coupled_period_;
  return n == 0 ? 0.0 : (drive_.omega_rad_s() - coupled_omega_rad_s_) * kCurrentLoop_Hz / static_cast<double>(n);
}

template <class Scales>
double BasicNativeEsc<Scales>::bus_current_A() const {
  const auto n = periods_ - coupled_period_;
  if (n == 0 || drive_.bus_V() <= 0.0) return 0.0;
  return (drive_.bus_energy_J() - coupled_energy_J_) * kCurrentLoop_Hz / (static_cast<double>(n) * drive_.bus_V());
}

}  // namespace rotorloop::sim
