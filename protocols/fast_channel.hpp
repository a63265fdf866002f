// The fast channel: set-points and feedback of ESCs at 1 kHz on 11-bit identifiers, beside DroneCAN on the same bus
// (docs/wire.md §3). One set-point frame serves a group of four ESCs; its arrival is the sync edge on which each ESC of the
// group answers with one feedback frame. 11-bit frames are invisible to DroneCAN tools. Integers on the wire, SI in the helpers.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "protocols/can_frame.hpp"
#include "protocols/word_frame.hpp"

namespace rotorloop::protocols::fast {

enum class SetpointMode : std::uint8_t { rpm = 0, duty = 1, current = 2 };  // 3 carries the version

// Of this layout. A host says its own before its first set-point and every second; an ESC that hears another one than its own refuses
// the set-points of its group and reports both numbers.
inline constexpr std::uint8_t kVersion = 1;
inline constexpr std::uint32_t kVersionMode = 3;

inline constexpr std::uint32_t kSetpointBase = 0x0A0;  // | mode << 2 | group
inline constexpr std::uint32_t kFeedbackBase = 0x140;  // | esc_index 0..15
inline constexpr int kEscsPerGroup = 4, kGroups = 4;
inline constexpr std::uint8_t kSequenceModulo = 16;

inline constexpr std::int16_t kNoOrder = -16384;  // this ESC is not addressed: its time-out runs on
inline constexpr std::int32_t kSetpointMax = 16383;
inline constexpr std::int16_t kSpeedInvalid = -32768;

// Values of one LSB on the wire.
inline constexpr float kRadPerSecondPerRpm = 0.104719755f;  // 2π/60
inline constexpr float kSpeedLsb_rad_s = 2.0f * kRadPerSecondPerRpm;
inline constexpr float kDutyLsb = 1.0f / 16383.0f;
inline constexpr float kCurrentLsb_A = 0.010f;
inline constexpr float kFeedbackSpeedLsb_rad_s = kRadPerSecondPerRpm;
inline constexpr float kFeedbackCurrentLsb_A = 0.050f;
inline constexpr float kFeedbackVoltageLsb_V = 0.010f;

// Rounds half away from zero and clamps; NaN has no answer here and gives 0, so callers test for it first.
constexpr std::int32_t quantise(float value, float lsb, std::int32_t min, std::int32_t max) {
  const float x = value / lsb;
  if (!(x == x)) return 0;
  if (x >= static_cast<float>(max)) return max;
  if (x <= static_cast<float>(min)) return min;
  return static_cast<std::int32_t>(x < 0.0f ? x - 0.5f : x + 0.5f);
}

constexpr float setpoint_lsb(SetpointMode mode) {
  return mode == SetpointMode::rpm ? kSpeedLsb_rad_s : mode == SetpointMode::duty ? kDutyLsb : kCurrentLsb_A;
}

struct Setpoint {
  SetpointMode mode = SetpointMode::rpm;
  std::uint8_t group = 0;                                                               // esc_index / 4
  std::uint8_t sequence = 0;                                                            // 0..15, +1 per frame of this group
  std::array<std::int16_t, kEscsPerGroup> raw{kNoOrder, kNoOrder, kNoOrder, kNoOrder};  // ±16383 LSB, or kNoOrder

  // rad/s, duty -1..1 or A by mode; clamps. NaN becomes "no order".
  constexpr void set(int slot, float value) {
    raw[static_cast<std::size_t>(slot)] =
        value == value ? static_cast<std::int16_t>(quantise(value, setpoint_lsb(mode), -kSetpointMax, kSetpointMax)) : kNoOrder;
  }
  // NaN when there is no order for this slot.
  constexpr float get(int slot) const {
    const std::int16_t r = raw[static_cast<std::size_t>(slot)];
    return r == kNoOrder ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(r) * setpoint_lsb(mode);
  }
  friend constexpr bool operator==(const Setpoint&, const Setpoint&) = default;
};

struct Feedback {
  std::uint8_t esc_index = 0;              // 0..15
  std::uint8_t sequence = 0;               // of the last set-point this ESC used
  std::int16_t speed_rpm = kSpeedInvalid;  // mechanical, signed
  std::int16_t current_50mA = 0;           // ±2047: ±102.35 A
  std::optional<std::uint16_t> bus_10mV;   // only in the 6-byte form

  constexpr void set_speed_rad_s(float v) {
    speed_rpm = v == v ? static_cast<std::int16_t>(quantise(v, kFeedbackSpeedLsb_rad_s, -32767, 32767)) : kSpeedInvalid;
  }
  constexpr void set_current_A(float v) { current_50mA = static_cast<std::int16_t>(quantise(v, kFeedbackCurrentLsb_A, -2047, 2047)); }
  constexpr void set_bus_V(float v) { bus_10mV = static_cast<std::uint16_t>(quantise(v, kFeedbackVoltageLsb_V, 0, 65535)); }
  constexpr bool speed_valid() const { return speed_rpm != kSpeedInvalid; }
  constexpr float speed_rad_s() const {
    return speed_valid() ? static_cast<float>(speed_rpm) * kFeedbackSpeedLsb_rad_s : std::numeric_limits<float>::quiet_NaN();
  }
  constexpr float current_A() const { return static_cast<float>(current_50mA) * kFeedbackCurrentLsb_A; }
  friend constexpr bool operator==(const Feedback&, const Feedback&) = default;
};

constexpr CanFrame encode(const Setpoint& s) {
  std::uint64_t word = detail::field(std::uint64_t{s.sequence}, 4, 60);
  for (std::size_t i = 0; i < s.raw.size(); ++i) {
    const std::int32_t r = s.raw[i];
    const std::int32_t clamped = r > kSetpointMax ? kSetpointMax : r < kNoOrder ? -kSetpointMax : r;
    word |= detail::field(clamped, 15, 15u * static_cast<unsigned>(i));
  }
  return detail::word_frame(kSetpointBase | static_cast<std::uint32_t>(s.mode) << 2 | (s.group & 3u), 8, word);
}

constexpr bool is_setpoint_id(const CanFrame& f) { return !f.extended && (f.id & 0x7F0u) == kSetpointBase; }
constexpr bool is_feedback_id(const CanFrame& f) { return !f.extended && (f.id & 0x7F0u) == kFeedbackBase; }

// Empty for another id, the reserved mode or a wrong length.
constexpr std::optional<Setpoint> decode_setpoint(const CanFrame& f) {
  if (!is_setpoint_id(f) || f.length != 8 || (f.id >> 2 & 3u) == 3u) return std::nullopt;
  Setpoint s{.mode = static_cast<SetpointMode>(f.id >> 2 & 3u), .group = static_cast<std::uint8_t>(f.id & 3u)};
  const std::uint64_t word = detail::frame_word(f);
  for (std::size_t i = 0; i < s.raw.size(); ++i) {
    s.raw[i] = static_cast<std::int16_t>(detail::signed_field(word, 15, 15u * static_cast<unsigned>(i)));
  }
  s.sequence = static_cast<std::uint8_t>(word >> 60);
  return s;
}

constexpr CanFrame encode_version(std::uint8_t group, std::uint8_t version = kVersion) {
  return detail::word_frame(kSetpointBase | kVersionMode << 2 | (group & 3u), 1, version);
}
constexpr std::optional<std::uint8_t> decode_version(const CanFrame& f) {
  if (!is_setpoint_id(f) || f.length != 1 || (f.id >> 2 & 3u) != kVersionMode) return std::nullopt;
  return f.data[0];
}

constexpr CanFrame encode(const Feedback& b) {
  const std::int32_t current = b.current_50mA > 2047 ? 2047 : b.current_50mA < -2048 ? -2048 : b.current_50mA;
  const std::uint64_t word = detail::field(std::int32_t{b.speed_rpm}, 16, 0) | detail::field(current, 12, 16) |
                             detail::field(std::uint64_t{b.sequence}, 4, 28) | detail::field(std::uint64_t{b.bus_10mV.value_or(0)}, 16, 32);
  return detail::word_frame(kFeedbackBase | (b.esc_index & 0xFu), b.bus_10mV ? 6 : 4, word);
}

constexpr std::optional<Feedback> decode_feedback(const CanFrame& f) {
  if (!is_feedback_id(f) || (f.length != 4 && f.length != 6)) return std::nullopt;
  const std::uint64_t word = detail::frame_word(f);
  Feedback b;
  b.esc_index = static_cast<std::uint8_t>(f.id & 0xFu);
  b.sequence = static_cast<std::uint8_t>(word >> 28 & 0xFu);
  b.speed_rpm = static_cast<std::int16_t>(detail::signed_field(word, 16, 0));
  b.current_50mA = static_cast<std::int16_t>(detail::signed_field(word, 12, 16));
  if (f.length == 6) b.bus_10mV = static_cast<std::uint16_t>(word >> 32 & 0xFFFFu);
  return b;
}

// How far `now` is ahead of `last`, 0..15. 1..7: newer (n - 1 frames were lost); 0: the same; 8..15: older than half the range.
constexpr std::uint8_t sequence_ahead(std::uint8_t now, std::uint8_t last) { return static_cast<std::uint8_t>((now - last) & 0xFu); }
inline constexpr std::uint8_t kSequenceHalfRange = 8;

}  // namespace rotorloop::protocols::fast
