// Bus log as pcap for Wireshark: link type 227 (LINKTYPE_CAN_SOCKETCAN, tcpdump.org), nanosecond time stamps (magic
// 0xA1B23C4D, little-endian), so a round trip loses nothing. Each record: identifier as 32 bits BIG-endian with bit 31 =
// extended, 30 = remote, 29 = error report; length; flags (FD); two reserved bytes; data.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "host/bus/bus_frame.hpp"
#include "host/bus/logged_frames.hpp"
#include "host/bus/output_file.hpp"
#include "protocols/can_frame.hpp"

namespace rotorloop {

inline constexpr std::size_t kPcapFileHeaderBytes = 24;

std::size_t format_pcap_file_header(char* out);
// Writes record header and record into `out` (at least 32 bytes) and returns the length. time_ns in 0 … 2^32 seconds.
std::size_t format_pcap_record(char* out, std::int64_t time_ns, const CanFrame& frame);
// The same for either format; at least 88 bytes.
std::size_t format_pcap_record(char* out, std::int64_t time_ns, const BusFrame& frame);

class PcapWriter {
 public:
  explicit PcapWriter(const std::string& path);  // throws Error if the file cannot be created
  void write(std::int64_t time_ns, const CanFrame& frame) { file_.commit(format_pcap_record(file_.reserve(), time_ns, frame)); }
  void write(std::int64_t time_ns, const BusFrame& frame) { file_.commit(format_pcap_record(file_.reserve(), time_ns, frame)); }
  void flush() { file_.flush(); }  // throws Error when the disk refused
  void close() { file_.close(); }  // throws Error when the disk refused

 private:
  OutputFile file_;
};

// Either byte order, micro- or nanoseconds. Throws Error with file and record number; another link type is named in the message.
BusLog parse_pcap(std::string_view bytes, const std::string& name);
bool looks_like_pcap(std::string_view bytes);

}  // namespace rotorloop
