// Modbus frames: what is asked (PDU), and how it stands on a serial line (RTU: address, PDU, CRC-16) or in TCP (MBAP header, PDU).
// Sources: MODBUS Application Protocol Specification V1.1b3; MODBUS over Serial Line V1.02; MODBUS Messaging on TCP/IP V1.0b.
//
// What an RTU frame detects: the CRC's polynomial x^16 + x^15 + x^2 + 1 has the factor x + 1 (every odd number of flipped bits is seen) and
// order 32767 (two flipped bits are seen in frames up to 4095 bytes). RTU frames have at most 256 bytes, so every pattern of one, two or
// three flipped bits is detected, whatever the length. Hamming distance is 4: of the patterns with four flipped bits in an answer of eight
// registers (21 bytes) one of 6400 passes, of longer garbage one of 65 536. What also has to fit: slave, function and length.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace rotorloop::modbus {

inline constexpr std::size_t kMaxRtuFrame = 256, kMaxTcpFrame = 260, kMbapBytes = 7;

std::uint16_t crc16(std::span<const std::uint8_t> bytes);

// A request of the master: read `count` registers (fc 3, 4) or write `values` (fc 6: one, fc 16: several).
struct Request {
  std::uint8_t slave = 1;
  int fc = 3;
  std::uint16_t address = 0;
  std::uint16_t count = 1;
  std::vector<std::uint16_t> values;

  bool reads() const { return fc == 3 || fc == 4; }
  std::size_t reply_pdu_bytes() const { return reads() ? 2 + 2 * std::size_t{count} : 5; }
};
std::vector<std::uint8_t> request_pdu(const Request& request);

std::vector<std::uint8_t> rtu_frame(std::uint8_t slave, std::span<const std::uint8_t> pdu);
std::vector<std::uint8_t> tcp_frame(std::uint16_t transaction, std::uint8_t unit, std::span<const std::uint8_t> pdu);

// The PDU of an RTU frame that is addressed to `slave` and whose CRC is right.
std::optional<std::span<const std::uint8_t>> rtu_pdu(std::span<const std::uint8_t> frame, std::uint8_t slave);

// Bytes that a request has on a serial line, from its first bytes; 0: not known yet, or no function that is known here.
std::size_t rtu_request_bytes(std::span<const std::uint8_t> begin);

enum class Failure : std::uint8_t {
  none,
  timeout,     // nothing came
  incomplete,  // it stopped in the middle
  malformed,   // not the answer to what was asked: other slave, function or length
  crc,
  exception,    // the device refuses: Reply::exception
  disconnected  // TCP: the connection is gone
};
const char* name(Failure failure);
const char* exception_text(int code);

struct Reply {
  Failure failure = Failure::none;
  int exception = 0;
  std::vector<std::uint16_t> registers;
};
// Judges the PDU of an answer to `request`, its integrity checked already.
Reply read_reply(const Request& request, std::span<const std::uint8_t> pdu);

}  // namespace rotorloop::modbus
