#include "sim/drive/sensing.hpp"

#include <cstddef>

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
    r.phase[k] = quantise(volt * per_V + p_.offset_counts[k] + drift_share_ * p_.drift_counts[k] +
                          p_.noise_counts * noise_.quick_gaussian(drawn_++));
  }
  r.bus = quantise(bus_V * p_.bus_ratio * per_V + p_.bus_noise_counts * noise_.quick_gaussian(drawn_++));
  r.temperature = quantise((p_.temperature_zero_V + p_.temperature_V_per_K * (temperature_K - p_.temperature_zero_K)) * per_V);
  break_channels(r);
  if (p_.bad_sample_every > 0.0) spoil(r);
  return r;
}

std::array<std::uint16_t, 3> Sensing::sample_unloaded(const PhaseCurrents& i, const std::array<double, 3>& low_off_s) {
  constexpr std::uint64_t kUnloadedDraws = std::uint64_t{1} << 41;  // far from the numbers of the others
  const double per_V = 4096.0 / p_.reference_V;
  const std::array<double, 3> current = {i.u, i.v, i.w};
  AdcReading r;
  for (std::size_t k = 0; k < 3; ++k) {
    const double left_V = p_.current_V_per_A * p_.gain[k] * (1.0 - settled(p_, low_off_s[k])) * current[k];
    r.phase[k] = quantise((p_.current_zero_V + left_V) * per_V + p_.offset_counts[k] + drift_share_ * p_.drift_counts[k] +
                          p_.noise_counts * noise_.quick_gaussian(kUnloadedDraws + unloaded_drawn_++));
  }
  break_channels(r);
  if (p_.bad_sample_every > 0.0 && noise_.uniform(2 * kUnloadedDraws + unloaded_drawn_) * p_.bad_sample_every < 1.0)
    r.phase[unloaded_drawn_ % 3] = unloaded_drawn_ % 2 == 0 ? 0 : 4095;
  return r.phase;
}

// One channel of a sample at a rail or at any code: what a glitch on the analogue supply or a late conversion leaves.
void Sensing::spoil(AdcReading& r) {
  constexpr std::uint64_t kBadDraws = std::uint64_t{1} << 40;  // far from the numbers of the noise
  if (until_bad_ < 0.0) until_bad_ = -p_.bad_sample_every * log_exact(1.0 - noise_.uniform(kBadDraws));
  if ((until_bad_ -= 1.0) >= 0.0) return;
  const std::uint64_t n = kBadDraws + 4 * ++bad_;
  const double kind = noise_.uniform(n + 1);
  const std::uint16_t code = kind < 1.0 / 3   ? std::uint16_t{0}
                             : kind < 2.0 / 3 ? std::uint16_t{4095}
                                              : quantise(4095.0 * noise_.uniform(n + 2));
  std::uint16_t* const channels[] = {&r.phase[0], &r.phase[1], &r.phase[2], &r.bus, &r.temperature};
  *channels[static_cast<std::size_t>(5.0 * noise_.uniform(n + 3))] = code;
  until_bad_ = -p_.bad_sample_every * log_exact(1.0 - noise_.uniform(n));
}

void Sensing::break_channels(AdcReading& r) const {
  const auto zero = quantise(p_.current_zero_V * 4096.0 / p_.reference_V);
  std::uint16_t* const channels[] = {&r.phase[0], &r.phase[1], &r.phase[2], &r.temperature};
  for (std::size_t k = 0; k < faults.size(); ++k)
    if (faults[k] != ChannelFault::none)
      *channels[k] = faults[k] == ChannelFault::low_rail    ? std::uint16_t{0}
                     : faults[k] == ChannelFault::high_rail ? std::uint16_t{4095}
                                                            : zero;
}

}  // namespace rotorloop::sim
