#include "sim/drive/sensing.hpp"

namespace rotorloop::sim {
namespace {
// Nearest count; the conversion cuts what is behind the point.
std::uint16_t quantise(double counts) {
  return static_cast<std::uint16_t>(static_cast<int>(counts <= 0.0 ? 0.0 : counts >= 4095.0 ? 4095.0 : counts + 0.5));
}

// Share of the shunt's signal that the amplifier shows after `window_s`.
double settled(const SensingParameters& p, double window_s) {
  const double after_s = window_s - p.settle_dead_s, full_s = p.settle_full_s - p.settle_dead_s;
  return after_s <= 0.0 ? 0.0 : after_s >= full_s ? 1.0 : after_s / full_s;  // most often no division
}
}  // namespace

SensingParameters typical_board(const RandomStream& random) {
  SensingParameters p;
  for (std::size_t phase = 0; phase < 3; ++phase) {
    p.gain[phase] = 1.0 + 0.01 * random.gaussian(2 * phase);
    p.offset_counts[phase] = 12.0 * random.gaussian(2 * phase + 1);
  }
  return p;
}

AdcReading Sensing::sample(const PhaseCurrents& i, const std::array<double, 3>& low_window_s, double bus_V, double temperature_K) {
  const double per_V = 4096.0 / p_.reference_V;
  const std::array<double, 3> current = {i.u, i.v, i.w};
  AdcReading r;
  for (std::size_t k = 0; k < 3; ++k) {
    const double volt = p_.current_zero_V + p_.current_V_per_A * p_.gain[k] * settled(p_, low_window_s[k]) * current[k];
    r.phase[k] = quantise(volt * per_V + p_.offset_counts[k] + p_.noise_counts * noise_.quick_gaussian(drawn_++));
  }
  r.bus = quantise(bus_V * p_.bus_ratio * per_V + p_.bus_noise_counts * noise_.quick_gaussian(drawn_++));
  r.temperature = quantise((p_.temperature_zero_V + p_.temperature_V_per_K * (temperature_K - p_.temperature_zero_K)) * per_V);
  return r;
}

}  // namespace rotorloop::sim
