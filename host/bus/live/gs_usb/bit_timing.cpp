#include "host/bus/live/gs_usb/bit_timing.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop {
namespace {

constexpr std::uint32_t kMostQuanta = 4096;  // of one segment; the largest known controller (M_CAN) has 256 and 128

// The split of `quanta` that samples nearest to `sample_point`; the earlier one of two that are as near.
std::optional<std::uint32_t> nearest_seg2(std::uint32_t quanta, double sample_point, const BitTimingLimits& limits) {
  const std::uint32_t inner = quanta - 1;
  const std::uint32_t least = std::max(limits.seg2_min, inner > limits.seg1_max ? inner - limits.seg1_max : 0);
  if (inner < limits.seg1_min) return std::nullopt;
  const std::uint32_t most = std::min(limits.seg2_max, inner - limits.seg1_min);
  if (least > most) return std::nullopt;
  const double wanted = quanta * (1.0 - sample_point);
  const auto nearest = static_cast<std::uint32_t>(std::floor(wanted + 0.5));
  return std::clamp(nearest, least, most);
}

// The prescaler nearest to `wanted` that the controller has.
std::uint32_t nearest_prescaler(double wanted, const BitTimingLimits& limits) {
  const double step = limits.prescaler_step;
  const double steps = std::floor((wanted - limits.prescaler_min) / step + 0.5);
  const double most = std::floor((limits.prescaler_max - limits.prescaler_min) / step);
  return limits.prescaler_min + static_cast<std::uint32_t>(std::clamp(steps, 0.0, most)) * limits.prescaler_step;
}

struct Setting {
  std::uint32_t prescaler = 0, quanta = 0, seg2 = 0;
  double rate_error_ppm = INFINITY, sample_error = INFINITY;
  bool better_than(const Setting& other) const {
    if (rate_error_ppm != other.rate_error_ppm) return rate_error_ppm < other.rate_error_ppm;
    if (sample_error != other.sample_error) return sample_error < other.sample_error;
    return quanta > other.quanta;
  }
};

BitTiming timing_of(const Setting& s, double clock_Hz, const BitTimingLimits& limits) {
  const std::uint32_t seg1 = s.quanta - 1 - s.seg2;
  BitTiming t;
  t.prop_seg = seg1 / 2;
  t.phase_seg1 = seg1 - t.prop_seg;
  t.phase_seg2 = s.seg2;
  // As wide as the segments allow without moving the sample point by more than half of what follows it.
  t.sjw = std::clamp(std::min(t.phase_seg1, t.phase_seg2 / 2), std::uint32_t{1}, limits.sjw_max);
  t.prescaler = s.prescaler;
  t.rate_Hz = clock_Hz / (static_cast<double>(s.prescaler) * s.quanta);
  t.rate_error_ppm = s.rate_error_ppm;
  t.sample_point = static_cast<double>(s.quanta - s.seg2) / s.quanta;
  return t;
}

}  // namespace

bool BitTimingLimits::plausible() const {
  return seg1_min >= 1 && seg1_min <= seg1_max && seg1_max <= kMostQuanta && seg2_min >= 1 && seg2_min <= seg2_max &&
         seg2_max <= kMostQuanta && sjw_max >= 1 && prescaler_min >= 1 && prescaler_min <= prescaler_max && prescaler_step >= 1;
}

std::optional<BitTiming> choose_bit_timing(std::uint32_t clock_Hz, std::uint32_t rate_Hz, double sample_point,
                                           const BitTimingLimits& limits) {
  if (clock_Hz == 0 || rate_Hz == 0 || !limits.plausible()) return std::nullopt;
  Setting best;
  for (std::uint32_t quanta = 1 + limits.seg1_min + limits.seg2_min; quanta <= 1 + limits.seg1_max + limits.seg2_max; ++quanta) {
    const auto seg2 = nearest_seg2(quanta, sample_point, limits);
    if (!seg2) continue;
    const double wanted = static_cast<double>(clock_Hz) / (static_cast<double>(rate_Hz) * quanta);
    for (const double side : {-0.5, 0.5}) {  // the prescalers below and above: the error of the rate is not symmetric about it
      Setting s{.prescaler = nearest_prescaler(wanted + side * limits.prescaler_step, limits), .quanta = quanta, .seg2 = *seg2};
      const double product = static_cast<double>(s.prescaler) * quanta;
      s.rate_error_ppm = std::abs(clock_Hz - rate_Hz * product) / (rate_Hz * product) * 1e6;
      s.sample_error = std::abs(static_cast<double>(quanta - *seg2) / quanta - sample_point);
      if (s.better_than(best)) best = s;
    }
  }
  if (best.prescaler == 0) return std::nullopt;
  return timing_of(best, clock_Hz, limits);
}

}  // namespace rotorloop
