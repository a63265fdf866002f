// The whole of the hardware that the firmware core can touch: ADC counts, PWM compares, time, flash. The text of this concept is
// the contract of a board file; every board and every fake ends with static_assert(Board<…>). Amperes, volts, angles and
// speeds do not cross it: the core converts counts itself, so a simulation cannot leak its truth.
#pragma once
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rotorloop::firmware {

struct AdcCounts {
  std::array<std::uint16_t, 3> phase{};  // low-side shunt amplifiers U, V, W, all at the PWM centre (low sides on)
  std::uint16_t bus = 0;
  std::uint16_t temperature = 0;
};

struct PwmCompare {
  std::array<std::uint16_t, 3> phase{};  // high side on for compare/kPwmTop of the period
};

// Gates of the six FETs: bit k the high side of phase k, bit 3 + k its low side.
inline constexpr std::uint8_t kAllGates = 0x3F;
constexpr std::uint8_t high_gate(std::size_t phase) { return static_cast<std::uint8_t>(1u << phase); }
constexpr std::uint8_t low_gate(std::size_t phase) { return static_cast<std::uint8_t>(8u << phase); }

template <class B>
concept Board = requires(B b, const B& reader, PwmCompare compare, std::span<std::uint8_t> out, std::uint64_t word) {
  // Timing. Sampling, interrupt and update of the compares share one instant every kPwmPeriodsPerSample PWM periods: compares
  // written in an interrupt act from the next such instant on, for the whole sample period.
  requires B::kPwm_Hz >= 16'000 && B::kPwm_Hz <= 96'000;
  requires B::kPwmPeriodsPerSample >= 1 && B::kPwmPeriodsPerSample <= 2;
  requires B::kPwmTop >= 500;  // counts of a full duty
  requires B::kDeadTime_ns >
  0;  // 0 is shoot-through
  requires B::kSampleWindow_ns >
  0;  // low-side time before the sample that the amplifier needs to settle
  // Scales of the analogue front end.
  { B::kCurrent_A_per_count } -> std::convertible_to<float>;  // signed: the shunt amplifier may invert
  { B::kCurrentZero_counts } -> std::convertible_to<float>;   // nominal; the core calibrates at boot
  { B::kCurrentZeroTolerance_counts } -> std::convertible_to<float>;
  { B::kBus_V_per_count } -> std::convertible_to<float>;
  { B::kTemperature_K_per_count } -> std::convertible_to<float>;
  { B::kTemperatureZero_K } -> std::convertible_to<float>;     // at count 0
  { B::kSwitchResistance_ohm } -> std::convertible_to<float>;  // in series with each phase: FET and shunt share
  { B::kDiodeDrop_V } -> std::convertible_to<float>;
  { B::kTripCurrent_A } -> std::convertible_to<float>;  // software over-current; inside the shunt range

  { reader.adc() }
  noexcept->std::same_as<AdcCounts>;  // conversions of this sample instant
  // A phase's shunt amplifier half a PWM period before it, at the middle of the high sides' time: a shunt whose low side is off carries
  // nothing, so a phase whose high side was on for long enough shows its zero.
  { reader.unloaded_counts(std::size_t{}) }
  noexcept->std::same_as<std::uint16_t>;
  { b.set_compare(compare) }
  noexcept->std::same_as<void>;
  { b.bridge_on() }
  noexcept->std::same_as<void>;
  // Only these gates follow the compares, the others stay low; as bridge_on() and bridge_off() at once (on an STM32: CCxE and CCxNE).
  { b.gates_on(std::uint8_t{}) }
  noexcept->std::same_as<void>;
  { b.bridge_off() }
  noexcept->std::same_as<void>;  // all six gates low on return
  { reader.time_us() }
  noexcept->std::same_as<std::uint64_t>;
  // Parameter flash: `page` 0 or 1 of kFlashPageBytes; programming takes one erased 8-byte word.
  requires B::kFlashPageBytes >= 1024;
  { reader.flash_read(std::uint32_t{}, std::uint32_t{}, out) }
  noexcept->std::same_as<bool>;  // page, offset
  { b.flash_erase(std::uint32_t{}) }
  noexcept->std::same_as<bool>;
  { b.flash_program(std::uint32_t{}, std::uint32_t{}, word) }
  noexcept->std::same_as<bool>;  // page, offset
};

}  // namespace rotorloop::firmware
