// The few MAVLink 2 messages of PX4's simulator interface, from the field lists of the public message definitions (common.xml). A frame's
// checksum covers a byte that is made of the message's name and fields; a test makes it anew from these lists.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace rotorloop::hil::mavlink {

// X.25: polynomial 0x1021 reflected, start 0xFFFF.
constexpr std::uint16_t x25(std::uint16_t crc, std::uint8_t byte) {
  std::uint32_t t = (byte ^ crc) & 0xFFu;
  t = (t ^ t << 4) & 0xFFu;
  return static_cast<std::uint16_t>(crc >> 8 ^ t << 8 ^ t << 3 ^ t >> 4);
}
constexpr std::uint16_t x25(std::uint16_t crc, std::string_view text) {
  for (const char c : text) crc = x25(crc, static_cast<std::uint8_t>(c));
  return crc;
}

// Fields in the order of the wire (larger ones first), without extensions: "type name " each, an array with its length in square brackets.
struct Message {
  std::uint32_t id;
  std::string_view name, fields;
  std::size_t bytes;  // of the payload, without extensions
};
inline constexpr Message kHilActuatorControls{93, "HIL_ACTUATOR_CONTROLS",
                                              "uint64_t time_usec uint64_t flags float controls[16] uint8_t mode ", 81};
inline constexpr Message kHilRcInputsRaw{
    92, "HIL_RC_INPUTS_RAW",
    "uint64_t time_usec uint16_t chan1_raw uint16_t chan2_raw uint16_t chan3_raw uint16_t chan4_raw uint16_t chan5_raw uint16_t chan6_raw "
    "uint16_t chan7_raw uint16_t chan8_raw uint16_t chan9_raw uint16_t chan10_raw uint16_t chan11_raw uint16_t chan12_raw uint8_t rssi ",
    33};
inline constexpr Message kHilSensor{
    107, "HIL_SENSOR",
    "uint64_t time_usec float xacc float yacc float zacc float xgyro float ygyro float zgyro float xmag float ymag float zmag "
    "float abs_pressure float diff_pressure float pressure_alt float temperature uint32_t fields_updated ",
    64};
inline constexpr Message kHilGps{
    113, "HIL_GPS",
    "uint64_t time_usec int32_t lat int32_t lon int32_t alt uint16_t eph uint16_t epv uint16_t vel int16_t vn int16_t ve "
    "int16_t vd uint16_t cog uint8_t fix_type uint8_t satellites_visible ",
    36};

constexpr std::uint8_t extra_byte(const Message& m) {
  std::uint16_t crc = x25(x25(0xFFFF, m.name), " ");
  std::uint8_t length = 0;
  bool inside = false;
  for (const char c : m.fields) {
    if (c == '[') {
      inside = true;
    } else if (c == ']') {
      inside = false;
    } else if (inside) {
      length = static_cast<std::uint8_t>(10 * length + (c - '0'));
    } else {
      crc = x25(crc, static_cast<std::uint8_t>(c));
      if (c == ' ' && length != 0) crc = x25(crc, std::exchange(length, std::uint8_t{0}));  // behind the name's blank
    }
  }
  return static_cast<std::uint8_t>((crc & 0xFFu) ^ crc >> 8);
}

// Values one after the other, little-endian.
class Payload {
 public:
  template <class T>
  Payload& add(T value) {
    const auto at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
    return *this;
  }
  const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

// MAVLink 2: zeros at the end of the payload are left out, all but the first byte.
inline std::vector<std::uint8_t> frame(const Message& m, const Payload& payload, std::uint8_t sequence) {
  std::size_t size = payload.bytes().size();
  while (size > 1 && payload.bytes()[size - 1] == 0) --size;
  std::vector<std::uint8_t> f{0xFD,
                              static_cast<std::uint8_t>(size),
                              0,
                              0,
                              sequence,
                              1,
                              200,
                              static_cast<std::uint8_t>(m.id & 0xFFu),
                              static_cast<std::uint8_t>(m.id >> 8 & 0xFFu),
                              static_cast<std::uint8_t>(m.id >> 16 & 0xFFu)};
  f.insert(f.end(), payload.bytes().begin(), payload.bytes().begin() + static_cast<std::ptrdiff_t>(size));
  std::uint16_t crc = 0xFFFF;
  for (std::size_t i = 1; i < f.size(); ++i) crc = x25(crc, f[i]);
  crc = x25(crc, extra_byte(m));
  f.push_back(static_cast<std::uint8_t>(crc & 0xFFu));
  f.push_back(static_cast<std::uint8_t>(crc >> 8));
  return f;
}

// Finds messages of one kind in a stream of bytes, of either version of the protocol; what is damaged or another message is passed over.
class Finder {
 public:
  explicit Finder(const Message& m) : message_(m) {}
  void add(std::span<const std::uint8_t> bytes) { stream_.insert(stream_.end(), bytes.begin(), bytes.end()); }
  // The next payload, filled up with zeros; false: none is whole yet.
  bool next(std::vector<std::uint8_t>& payload) {
    while (!stream_.empty()) {
      const bool two = stream_[0] == 0xFD, one = stream_[0] == 0xFE;
      const std::size_t head = two ? 10 : 6;
      if (!two && !one) {
        stream_.erase(stream_.begin());
        continue;
      }
      if (stream_.size() < head) return false;
      const std::size_t size = stream_[1], whole = head + size + 2 + (two && (stream_[2] & 1u) != 0 ? 13 : 0);
      if (stream_.size() < whole) return false;
      const std::uint32_t id =
          two ? stream_[7] | static_cast<std::uint32_t>(stream_[8]) << 8 | static_cast<std::uint32_t>(stream_[9]) << 16 : stream_[5];
      std::uint16_t crc = 0xFFFF;
      for (std::size_t i = 1; i < head + size; ++i) crc = x25(crc, stream_[i]);
      crc = x25(crc, extra_byte(message_));
      const bool ours = id == message_.id && stream_[head + size] == (crc & 0xFFu) && stream_[head + size + 1] == crc >> 8;
      if (ours) {
        payload.assign(stream_.begin() + static_cast<std::ptrdiff_t>(head), stream_.begin() + static_cast<std::ptrdiff_t>(head + size));
        payload.resize(std::max(payload.size(), message_.bytes), 0);
      }
      // A damaged one may hide the start of the next: only its first byte goes.
      stream_.erase(stream_.begin(), stream_.begin() + static_cast<std::ptrdiff_t>(ours || id != message_.id ? whole : 1));
      if (ours) return true;
    }
    return false;
  }

 private:
  Message message_;
  std::vector<std::uint8_t> stream_;
};

}  // namespace rotorloop::hil::mavlink
