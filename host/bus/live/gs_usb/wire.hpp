// What goes over USB between a host and a gs_usb adapter (candleLight, CANable and others): requests on endpoint 0 and frames on two bulk
// endpoints. Numbers little-endian, written byte by byte. Source: linux/drivers/net/can/usb/gs_usb.c and candleLight_fw, gs_usb.h. Pure.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "host/bus/bus_frame.hpp"
#include "host/bus/live/error_report.hpp"
#include "host/bus/live/gs_usb/bit_timing.hpp"

namespace rotorloop::gs_usb {

// Vendor requests to the interface; the value is the channel, or 1 for those of the whole adapter (host_format, device_config).
enum class Request : std::uint8_t {
  host_format = 0,
  bit_timing = 1,
  mode = 2,
  limits = 4,
  device_config = 5,
  time_stamp = 6,
  identify = 7,
  data_bit_timing = 10,
  limits_with_data = 11,
  set_termination = 12,
  get_termination = 13,
  get_state = 14,
};

// Bits of `features` and of the flags of `mode`.
enum Feature : std::uint32_t {
  kListenOnly = 1u << 0,
  kLoopBack = 1u << 1,
  kOneShot = 1u << 3,
  kHardwareStamp = 1u << 4,
  kIdentify = 1u << 5,
  kFd = 1u << 8,
  kQuirkLpc546xx = 1u << 9,  // wants one byte more behind each frame
  kLimitsWithData = 1u << 10,
  kTermination = 1u << 11,
  kBusErrorReports = 1u << 12,
  kGetState = 1u << 13,
};

inline constexpr std::uint32_t kHostFormat = 0x0000BEEF;
inline constexpr std::uint32_t kModeReset = 0, kModeStart = 1;
inline constexpr std::uint32_t kReceived = 0xFFFFFFFF;  // echo id of a frame of another node
inline constexpr unsigned kMostChannels = 16;           // no known adapter has more than 5; a count beyond is garbage

inline constexpr std::size_t kHead_B = 12, kClassic_B = kHead_B + 8, kFd_B = kHead_B + 64, kStamp_B = 4;
inline constexpr std::size_t kLargest_B = 128;  // a frame of CAN FD with its stamp and padding to whole packets of 64 bytes

std::array<std::uint8_t, 4> encode_word(std::uint32_t value);
std::array<std::uint8_t, 8> encode_mode(std::uint32_t mode, std::uint32_t flags);
std::array<std::uint8_t, 20> encode_timing(const BitTiming& timing);
std::optional<std::uint32_t> decode_word(std::span<const std::uint8_t> bytes);

struct DeviceConfig {
  unsigned channels = 0;
  std::uint32_t software = 0, hardware = 0;  // versions
};
inline constexpr std::size_t kDeviceConfig_B = 12, kLimits_B = 40, kLimitsWithData_B = 72;
std::optional<DeviceConfig> decode_device_config(std::span<const std::uint8_t> bytes);

struct ChannelInfo {
  std::uint32_t features = 0;
  std::uint32_t clock_Hz = 0;
  BitTimingLimits nominal;
  std::optional<BitTimingLimits> data;  // of CAN FD
  bool has(Feature f) const { return (features & f) != 0; }
};
// From an answer to `limits` or `limits_with_data`. None for one that is too short.
std::optional<ChannelInfo> decode_channel(std::span<const std::uint8_t> bytes);

struct ControllerState {
  std::uint32_t state = 0;  // 0 active, 1 warning, 2 passive, 3 bus-off, 4 stopped, 5 sleeping
  std::uint32_t receive_errors = 0, transmit_errors = 0;
};
inline constexpr std::size_t kState_B = 12;
std::optional<ControllerState> decode_state(std::span<const std::uint8_t> bytes);

enum class Content : std::uint8_t { frame, echo, remote, error_report, malformed };

struct Message {
  Content content = Content::malformed;
  unsigned channel = 0;
  std::uint32_t echo_id = kReceived;
  bool overflow = false;                  // the adapter lost frames before this one
  BusFrame frame;                         // of `frame`
  ErrorReport report;                     // of `error_report`
  std::optional<std::uint32_t> stamp_us;  // the adapter's clock, which wraps after 71.6 minutes
};
// Which channel a message is of, without a look at the rest; none for one that is too short.
std::optional<unsigned> channel_of(std::span<const std::uint8_t> bytes);
// `stamped`: its channel was started with kHardwareStamp.
Message decode_message(std::span<const std::uint8_t> bytes, bool stamped);

struct FrameLayout {
  bool fd = false;     // the channel was started with kFd: frames of both kinds have the size of FD
  bool quirk = false;  // kQuirkLpc546xx
};
// Returns the bytes to send. `frame` must be possible().
std::size_t encode_frame(const BusFrame& frame, std::uint32_t echo_id, unsigned channel, FrameLayout layout,
                         std::span<std::uint8_t, kLargest_B> bytes);

}  // namespace rotorloop::gs_usb
