// Bytes are put and taken one by one: no struct overlay, so the file is the same from any host.
#include "host/bus/pcap_log.hpp"

#include "host/base/error.hpp"

namespace rotorloop {
namespace {

constexpr std::uint32_t kMagicMicro = 0xA1B2C3D4;
constexpr std::uint32_t kMagicNano = 0xA1B23C4D;
constexpr std::uint32_t kMagicPcapng = 0x0A0D0D0A;
constexpr std::uint32_t kSnapLength = 65'535;
constexpr std::uint32_t kLinkTypeCan = 227;
constexpr std::uint32_t kExtended = 0x80000000;
constexpr std::uint32_t kRemote = 0x40000000;
constexpr std::uint32_t kErrorReport = 0x20000000;
constexpr std::uint8_t kFdFrame = 0x04;  // flags byte; may be missing in old files, then the length (72) decides
constexpr std::uint8_t kFdRateSwitch = 0x01;
constexpr std::size_t kRecordHeaderBytes = 16;
constexpr std::size_t kCanHeaderBytes = 8;
constexpr std::int64_t kNs_per_s = 1'000'000'000;

char* put_u32(char* p, std::uint32_t v, bool big_endian = false) {
  for (int i = 0; i < 4; ++i) *p++ = static_cast<char>(v >> (big_endian ? 24 - 8 * i : 8 * i));
  return p;
}

std::uint32_t take_u32(std::string_view bytes, std::size_t at, bool big_endian) {
  std::uint32_t v = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::uint32_t byte = static_cast<std::uint8_t>(bytes[at + i]);
    v |= byte << (big_endian ? 24 - 8 * i : 8 * i);
  }
  return v;
}

[[noreturn]] void fail(const std::string& where, std::string what, std::string remedy) {
  throw Error({.where = where, .what = std::move(what), .likely = "", .remedy = std::move(remedy)});
}

}  // namespace

std::size_t format_pcap_file_header(char* out) {
  char* p = put_u32(out, kMagicNano);
  p = put_u32(p, 2 | 4u << 16);  // version 2.4
  p = put_u32(p, 0);             // time zone
  p = put_u32(p, 0);             // accuracy
  p = put_u32(p, kSnapLength);
  p = put_u32(p, kLinkTypeCan);
  return static_cast<std::size_t>(p - out);
}

std::size_t format_pcap_record(char* out, std::int64_t time_ns, const CanFrame& frame) {
  return format_pcap_record(out, time_ns, BusFrame(frame));
}

std::size_t format_pcap_record(char* out, std::int64_t time_ns, const BusFrame& frame) {
  const auto bytes = static_cast<std::uint32_t>(kCanHeaderBytes + frame.length);
  char* p = put_u32(out, static_cast<std::uint32_t>(time_ns / kNs_per_s));
  p = put_u32(p, static_cast<std::uint32_t>(time_ns % kNs_per_s));
  p = put_u32(p, bytes);
  p = put_u32(p, bytes);
  p = put_u32(p, frame.id | (frame.extended ? kExtended : 0), true);
  *p++ = static_cast<char>(frame.length);
  *p++ = static_cast<char>(frame.fd ? kFdFrame | (frame.bit_rate_switch ? kFdRateSwitch : 0) : 0);
  for (int i = 0; i < 2; ++i) *p++ = 0;
  for (std::size_t i = 0; i < frame.length; ++i) *p++ = static_cast<char>(frame.data[i]);
  return static_cast<std::size_t>(p - out);
}

PcapWriter::PcapWriter(const std::string& path) : file_(path) { file_.commit(format_pcap_file_header(file_.reserve())); }

bool looks_like_pcap(std::string_view bytes) {
  if (bytes.size() < 4) return false;
  for (const bool big_endian : {false, true}) {
    const std::uint32_t magic = take_u32(bytes, 0, big_endian);
    if (magic == kMagicMicro || magic == kMagicNano || magic == kMagicPcapng) return true;
  }
  return false;
}

BusLog parse_pcap(std::string_view bytes, const std::string& name) {
  if (bytes.size() >= 4 && take_u32(bytes, 0, false) == kMagicPcapng) {
    fail(name, "this is a pcapng file, only pcap can be read", "convert it: editcap -F nsecpcap IN OUT");
  }
  if (bytes.size() < kPcapFileHeaderBytes || !looks_like_pcap(bytes))
    fail(name, "not a pcap file: no file header", "give a pcap or candump -L file");
  const std::uint32_t first = take_u32(bytes, 0, true);
  const bool big_endian = first == kMagicMicro || first == kMagicNano;
  const std::int64_t fraction_ns = take_u32(bytes, 0, big_endian) == kMagicNano ? 1 : 1'000;
  const std::uint32_t link_type = take_u32(bytes, 20, big_endian) & 0x0FFFFFFF;
  if (link_type != kLinkTypeCan) {
    fail(name, "link type " + std::to_string(link_type) + ", a CAN recording has 227 (SocketCAN)", "record on a CAN interface");
  }

  BusLog log;
  log.interfaces.emplace_back();
  std::size_t at = kPcapFileHeaderBytes;
  for (std::size_t number = 1; at < bytes.size(); ++number) {
    const std::string where = name + ": record " + std::to_string(number);
    if (bytes.size() - at < kRecordHeaderBytes)
      fail(where, "the file ends within a record header", "the recording was cut: record again, or cut the rest off");
    const std::int64_t time_ns = take_u32(bytes, at, big_endian) * kNs_per_s + take_u32(bytes, at + 4, big_endian) * fraction_ns;
    const std::size_t length = take_u32(bytes, at + 8, big_endian);
    at += kRecordHeaderBytes;
    if (bytes.size() - at < length) fail(where, "the file ends within a frame", "the recording was cut: record again, or cut the rest off");
    const std::string_view record = bytes.substr(at, length);
    at += length;
    if (length < kCanHeaderBytes) fail(where, "a CAN record has 8 bytes or more, found " + std::to_string(length), "the file is damaged");
    const std::uint32_t id = take_u32(record, 0, true);
    const auto data_length = static_cast<std::uint8_t>(record[4]);
    if ((id & kErrorReport) != 0) {
      ++log.skipped_error;
    } else if ((id & kRemote) != 0) {
      ++log.skipped_remote;
    } else {
      const auto flags = static_cast<std::uint8_t>(record[5]);
      const bool fd = (flags & kFdFrame) != 0 || data_length > 8;
      if (!possible_length(fd, data_length))
        fail(where, std::to_string(data_length) + " data bytes, which no CAN frame has", "the file is damaged");
      if (length < kCanHeaderBytes + data_length)
        fail(where, "frame says " + std::to_string(data_length) + " data bytes, the record has fewer", "the file is damaged");
      LoggedFrame entry{.time_ns = time_ns, .interface = 0, .frame = {}};
      entry.frame.fd = fd;
      entry.frame.bit_rate_switch = fd && (flags & kFdRateSwitch) != 0;
      entry.frame.extended = (id & kExtended) != 0;
      entry.frame.id = id & (entry.frame.extended ? 0x1FFFFFFFu : 0x7FFu);
      entry.frame.length = data_length;
      for (std::size_t i = 0; i < data_length; ++i) entry.frame.data[i] = static_cast<std::uint8_t>(record[kCanHeaderBytes + i]);
      log.frames.push_back(entry);
    }
  }
  return log;
}

}  // namespace rotorloop
