// An ESC without a motor: speed follows the command as a first-order lag. For ablations only ("what if the actuator were
// ideal but slow"); it has the coupling interface of NativeEsc.
#pragma once
#include <cstdint>

#include "firmware/core/interface.hpp"
#include "host/base/elementary.hpp"

namespace rotorloop::sim {

struct LagEscConfig {
  double time_constant_s = 0.030;
  double max_speed_rad_s = 1780.0;
  double initial_rad_s = 0.0;
};

class LagEsc {
 public:
  explicit LagEsc(const LagEscConfig& config = {})
      : config_(config), omega_rad_s_(config.initial_rad_s), keep_(exp_exact(-1.0 / (24000.0 * config.time_constant_s))) {}
  void set_setpoint(const firmware::Setpoint& s) {
    const double wanted = s.mode == firmware::Mode::speed ? static_cast<double>(s.value) : 0.0;
    target_rad_s_ = wanted > config_.max_speed_rad_s    ? config_.max_speed_rad_s
                    : wanted < -config_.max_speed_rad_s ? -config_.max_speed_rad_s
                                                        : wanted;
  }
  void step_current_loop() {
    omega_rad_s_ = target_rad_s_ + keep_ * (omega_rad_s_ - target_rad_s_);
    ++periods_;
  }
  void couple(double load_torque_N_m, double bus_V) {
    bus_A_ = bus_V > 0.0 ? load_torque_N_m * omega_rad_s_ / bus_V : 0.0;  // a lossless motor
    bus_V_ = bus_V;
    coupled_omega_rad_s_ = omega_rad_s_;
    coupled_period_ = periods_;
  }
  double omega_rad_s() const { return omega_rad_s_; }
  double shaft_acceleration_rad_s2() const {
    const auto n = periods_ - coupled_period_;
    return n == 0 ? 0.0 : (omega_rad_s_ - coupled_omega_rad_s_) * 24000.0 / static_cast<double>(n);
  }
  double bus_current_A() const { return bus_A_; }
  firmware::Telemetry telemetry() const {
    firmware::Telemetry t;
    t.state = target_rad_s_ == 0.0 ? firmware::MotorState::off : firmware::MotorState::running;
    t.speed_valid = true;
    t.speed_rad_s = static_cast<float>(omega_rad_s_);
    t.bus_V = static_cast<float>(bus_V_);
    t.bus_A = static_cast<float>(bus_A_);
    t.temperature_K = 298.15f;
    return t;
  }
  std::int64_t time_us() const { return static_cast<std::int64_t>(periods_ * 125 / 3); }

 private:
  LagEscConfig config_;
  double omega_rad_s_, keep_, target_rad_s_ = 0.0, bus_A_ = 0.0, bus_V_ = 0.0;
  double coupled_omega_rad_s_ = 0.0;
  std::uint64_t periods_ = 0, coupled_period_ = 0;
};

}  // namespace rotorloop::sim
