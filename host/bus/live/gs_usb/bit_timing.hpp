// Segments of a CAN bit for a controller of any clock. A bit has 1 (synchronisation) + seg1 + seg2 quanta; it is sampled between seg1 and
// seg2; a quantum is `prescaler` periods of the clock (ISO 11898-1:2015, 11.3.1). Pure.
#pragma once
#include <cstdint>
#include <optional>

namespace rotorloop {

inline constexpr double kSamplePoint = 0.875, kDataSamplePoint = 0.75;  // CiA 301, table 1; CiA 601-3 for the data phase of CAN FD
// Beyond, nodes may lose step within a frame where another one is as far off the other way (ISO 11898-1 allows crystals some 0.1 to 1 %).
inline constexpr double kMostRateError_ppm = 1000.0;

// What a controller can be set to.
struct BitTimingLimits {
  std::uint32_t seg1_min = 0, seg1_max = 0;  // quanta: propagation and phase segment 1 together
  std::uint32_t seg2_min = 0, seg2_max = 0;
  std::uint32_t sjw_max = 0;
  std::uint32_t prescaler_min = 0, prescaler_max = 0, prescaler_step = 0;

  // None of these controllers exists: a zero that is divided by, a least value above its largest, more than 32 bits hold.
  bool plausible() const;
  friend bool operator==(const BitTimingLimits&, const BitTimingLimits&) = default;
};

struct BitTiming {
  std::uint32_t prop_seg = 0, phase_seg1 = 0, phase_seg2 = 0;  // quanta
  std::uint32_t sjw = 0;                                       // quanta by which a bit may be shortened or prolonged
  std::uint32_t prescaler = 0;
  double rate_Hz = 0.0;         // as it comes out
  double rate_error_ppm = 0.0;  // against the rate asked for, without sign
  double sample_point = 0.0;    // 0..1

  std::uint32_t quanta() const { return 1 + prop_seg + phase_seg1 + phase_seg2; }
};

// The setting of the least error of the rate; among those the one that samples nearest to `sample_point`, then the one of most quanta.
// None where no setting is within `limits`. Whether the error is small enough is the caller's question (kMostRateError_ppm).
std::optional<BitTiming> choose_bit_timing(std::uint32_t clock_Hz, std::uint32_t rate_Hz, double sample_point,
                                           const BitTimingLimits& limits);

}  // namespace rotorloop
