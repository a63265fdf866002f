#include "host/bus/live/gs_usb/wire.hpp"

#include <linux/can.h>

#include <algorithm>
#include <utility>

namespace rotorloop::gs_usb {
namespace {

constexpr std::uint8_t kFlagOverflow = 1, kFlagFd = 2, kFlagBitRateSwitch = 4;
constexpr std::size_t kAtCode = 8, kAtChannel = 9, kAtFlags = 10;

std::uint32_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) | static_cast<std::uint32_t>(bytes[at + 1]) << 8 |
         static_cast<std::uint32_t>(bytes[at + 2]) << 16 | static_cast<std::uint32_t>(bytes[at + 3]) << 24;
}

void put(std::span<std::uint8_t> bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> 8 * i);
}

BitTimingLimits limits_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  const auto next = [&] { return word(bytes, std::exchange(at, at + 4)); };
  BitTimingLimits l;
  l.seg1_min = next();
  l.seg1_max = next();
  l.seg2_min = next();
  l.seg2_max = next();
  l.sjw_max = next();
  l.prescaler_min = next();
  l.prescaler_max = next();
  l.prescaler_step = next();
  return l;
}

std::uint8_t code_of(std::uint8_t length) {
  if (length <= 8) return length;
  const auto at = std::find(kFdLengths.begin(), kFdLengths.end(), length);
  return static_cast<std::uint8_t>(9 + (at - kFdLengths.begin()));
}

// A classic frame may say 9 to 15 and has 8 bytes (ISO 11898-1:2015, 8.4.2.4).
std::uint8_t length_of(std::uint8_t code, bool fd) {
  if (code <= 8) return code;
  return fd ? kFdLengths[code - 9u] : 8;
}

ErrorReport report_of(std::uint32_t id, std::span<const std::uint8_t> data) {
  canfd_frame raw{};
  raw.can_id = id;
  raw.len = 8;
  std::copy_n(data.begin(), 8, raw.data);
  return decode_error_report(raw);
}

}  // namespace

std::array<std::uint8_t, 4> encode_word(std::uint32_t value) {
  std::array<std::uint8_t, 4> bytes{};
  put(bytes, 0, value);
  return bytes;
}

std::array<std::uint8_t, 8> encode_mode(std::uint32_t mode, std::uint32_t flags) {
  std::array<std::uint8_t, 8> bytes{};
  put(bytes, 0, mode);
  put(bytes, 4, flags);
  return bytes;
}

std::array<std::uint8_t, 20> encode_timing(const BitTiming& t) {
  std::array<std::uint8_t, 20> bytes{};
  std::size_t at = 0;
  for (const std::uint32_t value : {t.prop_seg, t.phase_seg1, t.phase_seg2, t.sjw, t.prescaler})
    put(bytes, std::exchange(at, at + 4), value);
  return bytes;
}

std::optional<std::uint32_t> decode_word(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 4) return std::nullopt;
  return word(bytes, 0);
}

std::optional<DeviceConfig> decode_device_config(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kDeviceConfig_B) return std::nullopt;
  return DeviceConfig{.channels = bytes[3] + 1u, .software = word(bytes, 4), .hardware = word(bytes, 8)};
}

std::optional<ChannelInfo> decode_channel(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kLimits_B) return std::nullopt;
  ChannelInfo info{.features = word(bytes, 0), .clock_Hz = word(bytes, 4), .nominal = limits_at(bytes, 8), .data = {}};
  if (bytes.size() >= kLimitsWithData_B) info.data = limits_at(bytes, kLimits_B);
  return info;
}

std::optional<ControllerState> decode_state(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kState_B) return std::nullopt;
  return ControllerState{.state = word(bytes, 0), .receive_errors = word(bytes, 4), .transmit_errors = word(bytes, 8)};
}

std::optional<unsigned> channel_of(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kHead_B) return std::nullopt;
  return bytes[kAtChannel];
}

Message decode_message(std::span<const std::uint8_t> bytes, bool stamped) {
  Message m;
  if (bytes.size() < kHead_B) return m;
  const std::uint8_t flags = bytes[kAtFlags], code = bytes[kAtCode];
  const bool fd = (flags & kFlagFd) != 0;
  const std::size_t size = fd ? kFd_B : kClassic_B;
  if (bytes.size() < size || code > 15) return m;
  m.channel = bytes[kAtChannel];
  m.echo_id = word(bytes, 0);
  m.overflow = (flags & kFlagOverflow) != 0;
  if (stamped && bytes.size() >= size + kStamp_B) m.stamp_us = word(bytes, size);
  const std::uint32_t id = word(bytes, 4);
  if (m.echo_id != kReceived) {
    m.content = Content::echo;
    return m;
  }
  if ((id & CAN_ERR_FLAG) != 0) {
    m.content = Content::error_report;
    m.report = report_of(id, bytes.subspan(kHead_B));
    return m;
  }
  if ((id & CAN_RTR_FLAG) != 0) {
    m.content = Content::remote;
    return m;
  }
  m.frame.extended = (id & CAN_EFF_FLAG) != 0;
  m.frame.id = id & (m.frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  m.frame.fd = fd;
  m.frame.bit_rate_switch = fd && (flags & kFlagBitRateSwitch) != 0;
  m.frame.length = length_of(code, fd);
  std::copy_n(bytes.begin() + kHead_B, m.frame.length, m.frame.data.begin());
  m.content = Content::frame;
  return m;
}

std::size_t encode_frame(const BusFrame& frame, std::uint32_t echo_id, unsigned channel, FrameLayout layout,
                         std::span<std::uint8_t, kLargest_B> bytes) {
  std::fill(bytes.begin(), bytes.end(), std::uint8_t{0});
  put(bytes, 0, echo_id);
  put(bytes, 4, frame.id | (frame.extended ? CAN_EFF_FLAG : 0u));
  bytes[kAtCode] = code_of(frame.length);
  bytes[kAtChannel] = static_cast<std::uint8_t>(channel);
  if (frame.fd) bytes[kAtFlags] = static_cast<std::uint8_t>(kFlagFd | (frame.bit_rate_switch ? kFlagBitRateSwitch : 0));
  std::copy_n(frame.data.begin(), frame.length, bytes.begin() + kHead_B);
  return (layout.fd ? kFd_B : kClassic_B) + (layout.quirk ? 1 : 0);
}

}  // namespace rotorloop::gs_usb
