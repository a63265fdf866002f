#include "sim/esc/native_esc.hpp"

#include <algorithm>
#include <array>
#include <numbers>

namespace rotorloop::sim {
namespace {

constexpr std::uint64_t kNoiseStream = 0x45534E01, kBoardStream = 0x45534E02, kAngleStream = 0x45534E03;
constexpr double kSlow_rad_s = 20.0;  // below this the load coefficient torque/speed² means nothing

RandomStream stream(const NativeEscConfig& c, std::uint64_t purpose) { return {c.seed, (c.module << 32) | purpose}; }

DriveParameters with_spread(const NativeEscConfig& c) {
  DriveParameters d = c.drive;
  if (c.draw_board_spread) {
    const SensingParameters drawn = typical_board(stream(c, kBoardStream));
    d.sensing.gain = drawn.gain;
    d.sensing.offset_counts = drawn.offset_counts;
  }
  return d;
}

}  // namespace

NativeEsc::NativeEsc(const NativeEscConfig& c)
    : drive_(with_spread(c), stream(c, kNoiseStream), 2.0 * std::numbers::pi * stream(c, kAngleStream).uniform(0)),
      board_(),
      motor_(c.firmware) {
  drive_.set_bus_V(c.bus_V);
}

PwmCommand NativeEsc::run_firmware() {
  // The compares written in the previous interrupt take effect at this instant.
  active_ = board_.compare;
  const AdcReading adc = drive_.sample();
  board_.counts = {adc.phase, adc.bus, adc.temperature};
  board_.now_us = static_cast<std::uint64_t>(time_us());
  motor_.set_setpoint(setpoint_);
  motor_.on_sample(board_);
  return {active_.phase, static_cast<std::uint16_t>(firmware::FakeBoard::kPwmTop), board_.bridge};
}

void NativeEsc::step_current_loop() {
  NativeEsc* const alone = this;
  step_current_loops({&alone, 1});
}

void NativeEsc::step_current_loops(std::span<NativeEsc* const> escs) {
  std::array<Drive*, Lanes::kCount> drives;
  std::array<PwmCommand, Lanes::kCount> pwm;
  while (!escs.empty()) {
    const std::size_t n = std::min(escs.size(), Lanes::kCount);
    for (std::size_t i = 0; i < n; ++i) {
      pwm[i] = escs[i]->run_firmware();
      drives[i] = &escs[i]->drive_;
      ++escs[i]->periods_;
    }
    Drive::step_together({drives.data(), n}, {pwm.data(), n}, static_cast<int>(firmware::FakeBoard::kPwmPeriodsPerSample));
    escs = escs.subspan(n);
  }
}

void NativeEsc::couple(double load_torque_N_m, double bus_V) {
  const double w = std::fabs(drive_.omega_rad_s());
  const double floor_rad_s = w > kSlow_rad_s ? w : kSlow_rad_s;
  couple_quadratic(load_torque_N_m / (floor_rad_s * floor_rad_s), bus_V);
}

void NativeEsc::couple_quadratic(double load_N_m_s2, double bus_V) {
  drive_.set_load({load_N_m_s2, 0.0});
  drive_.set_bus_V(bus_V);
  coupled_omega_rad_s_ = drive_.omega_rad_s();
  coupled_energy_J_ = drive_.bus_energy_J();
  coupled_period_ = periods_;
}

double NativeEsc::shaft_acceleration_rad_s2() const {
  const auto n = periods_ - coupled_period_;
  return n == 0 ? 0.0 : (drive_.omega_rad_s() - coupled_omega_rad_s_) * kCurrentLoop_Hz / static_cast<double>(n);
}

double NativeEsc::bus_current_A() const {
  const auto n = periods_ - coupled_period_;
  if (n == 0 || drive_.bus_V() <= 0.0) return 0.0;
  return (drive_.bus_energy_J() - coupled_energy_J_) * kCurrentLoop_Hz / (static_cast<double>(n) * drive_.bus_V());
}

}  // namespace rotorloop::sim
