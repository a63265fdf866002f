#include "bench/stand/virtual/signal_chain.hpp"

#include <cmath>
#include <numbers>

namespace rotorloop::virtual_stand {
namespace {

constexpr std::uint64_t kErrorsModule = 0x56535445, kNoiseModule = 0x56534e4f;
constexpr double kTurns_rad_s = 5.0;
constexpr double kReversal_N = 0.1;  // smaller changes of thrust do not turn the friction of the mount

}  // namespace

ChainErrors drawn_errors(std::uint64_t seed, const std::array<double, 2>& full) {
  const RandomStream r(seed, kErrorsModule);
  std::uint64_t n = 0;
  const auto normal = [&](double sigma) { return sigma * r.gaussian(n++); };
  ChainErrors e;
  e.thrust_gain = normal(0.004);
  e.torque_gain = normal(0.004);
  e.sensitivity[0][1] = normal(0.01) * full[0] / full[1];
  e.sensitivity[1][0] = normal(0.01) * full[1] / full[0];
  e.zero_N = normal(0.05);
  e.zero_N_m = normal(1e-3);
  e.drift_N = normal(0.04);
  e.hysteresis_N = normal(0.02);
  const double sign = r.uniform(n++) < 0.5 ? -1.0 : 1.0;
  e.running_N_m = sign * (5e-3 + 5e-3 * r.uniform(n++));
  e.pressure = normal(0.003);
  e.alignment_rad = normal(std::numbers::pi / 180.0);
  e.speed = normal(5e-4);
  e.voltage = normal(3e-3);
  e.current = normal(5e-3);
  return e;
}

SignalChain::SignalChain(const ChainErrors& errors, const ChainProperties& properties, std::uint64_t seed, double dt_s)
    : errors_(errors), properties_(properties), noise_(seed, kNoiseModule), dt_s_(dt_s) {}

void SignalChain::step(double thrust_N, double torque_N_m, double omega_rad_s) {
  const ChainErrors& e = errors_;
  const double along = std::cos(e.alignment_rad);
  std::array<double, 2> load{along * thrust_N, along * torque_N_m};
  for (std::size_t i = 0; i < 2; ++i) {
    const double w = 2.0 * std::numbers::pi * properties_.ring_Hz[i];
    rate_[i] += dt_s_ * (w * w * (load[i] - position_[i]) - 2.0 * properties_.ring_damping * w * rate_[i]);
    position_[i] += dt_s_ * rate_[i];  // semi-implicit: neither gains nor loses energy by itself
    load[i] = position_[i];
  }
  creep_ += dt_s_ / properties_.creep_s * (properties_.creep_share * load[0] - creep_);
  // Friction follows what the rotor does to the mount, not the mount's own ringing.
  if (sense_ * (thrust_N - turned_at_N_) > 0.0)
    turned_at_N_ = thrust_N;
  else if (std::abs(thrust_N - turned_at_N_) > kReversal_N) {
    sense_ = -sense_;
    turned_at_N_ = thrust_N;
  }
  const bool turns = std::abs(omega_rad_s) > kTurns_rad_s;
  load[0] = (1.0 + e.thrust_gain) * (load[0] + creep_) + e.zero_N + e.drift_N * t_s_ / e.drift_s + (turns ? sense_ * e.hysteresis_N : 0.0);
  load[1] = (1.0 + e.torque_gain) * load[1] + e.zero_N_m + e.drift_N_m * t_s_ / e.drift_s + (turns ? e.running_N_m : 0.0);
  const double share = 1.0 - std::exp(-dt_s_ / properties_.filter_s);
  for (std::size_t i = 0; i < 2; ++i) {
    // White before the filter, of a size that leaves the wanted deviation behind it.
    const double white = properties_.noise[i] * std::sqrt((2.0 - share) / share) * noise_.quick_gaussian(2 * steps_ + i);
    const double reading =
        e.sensitivity[i][0] * load[0] + e.sensitivity[i][1] * load[1] + e.reading_zero[i] + std::abs(e.sensitivity[i][i]) * white;
    shown_[i] += share * (reading - shown_[i]);
  }
  t_s_ += dt_s_;
  ++steps_;
}

double SignalChain::rounded(std::size_t axis, double reading) const {
  const double division = properties_.division[axis] * std::abs(errors_.sensitivity[axis][axis]);
  return division > 0.0 ? division * std::round(reading / division) : reading;
}

}  // namespace rotorloop::virtual_stand
