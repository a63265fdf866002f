#include "bench/stand/instruments/frame.hpp"

#include <array>

namespace rotorloop::modbus {
namespace {

constexpr std::array<std::uint16_t, 256> crc_table() {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 0; i < 256; ++i) {
    unsigned c = static_cast<unsigned>(i);
    for (int k = 0; k < 8; ++k) c = (c & 1u) ? (c >> 1) ^ 0xA001u : c >> 1;  // 0x8005, least significant bit first
    table[i] = static_cast<std::uint16_t>(c);
  }
  return table;
}
constexpr auto kCrcTable = crc_table();

void put(std::vector<std::uint8_t>& to, std::uint16_t word) {
  to.push_back(static_cast<std::uint8_t>(word >> 8));
  to.push_back(static_cast<std::uint8_t>(word & 0xFFu));
}
std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t i) {
  return static_cast<std::uint16_t>((bytes[i] << 8) | bytes[i + 1]);
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  unsigned crc = 0xFFFFu;
  for (const std::uint8_t b : bytes) crc = (crc >> 8) ^ kCrcTable[(crc ^ b) & 0xFFu];
  return static_cast<std::uint16_t>(crc);
}

std::vector<std::uint8_t> request_pdu(const Request& r) {
  std::vector<std::uint8_t> pdu{static_cast<std::uint8_t>(r.fc)};
  put(pdu, r.address);
  if (r.fc == 6) {
    put(pdu, r.values.at(0));
  } else {
    put(pdu, r.reads() ? r.count : static_cast<std::uint16_t>(r.values.size()));
    if (!r.reads()) {
      pdu.push_back(static_cast<std::uint8_t>(2 * r.values.size()));
      for (const std::uint16_t v : r.values) put(pdu, v);
    }
  }
  return pdu;
}

std::vector<std::uint8_t> rtu_frame(std::uint8_t slave, std::span<const std::uint8_t> pdu) {
  std::vector<std::uint8_t> frame{slave};
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  const std::uint16_t crc = crc16(frame);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFFu));  // the one place of Modbus with the low byte first
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}

std::vector<std::uint8_t> tcp_frame(std::uint16_t transaction, std::uint8_t unit, std::span<const std::uint8_t> pdu) {
  std::vector<std::uint8_t> frame;
  put(frame, transaction);
  put(frame, 0);
  put(frame, static_cast<std::uint16_t>(pdu.size() + 1));
  frame.push_back(unit);
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  return frame;
}

std::optional<std::span<const std::uint8_t>> rtu_pdu(std::span<const std::uint8_t> frame, std::uint8_t slave) {
  if (frame.size() < 4 || frame.size() > kMaxRtuFrame || frame[0] != slave) return std::nullopt;
  const auto body = frame.first(frame.size() - 2);
  const unsigned sent = frame[frame.size() - 2] | (frame[frame.size() - 1] << 8);
  if (crc16(body) != sent) return std::nullopt;
  return body.subspan(1);
}

std::size_t rtu_request_bytes(std::span<const std::uint8_t> begin) {
  if (begin.size() < 2) return 0;
  if (begin[1] == 3 || begin[1] == 4 || begin[1] == 6) return 8;
  if (begin[1] == 16 && begin.size() >= 7) return 9 + std::size_t{begin[6]};
  return 0;
}

const char* name(Failure f) {
  switch (f) {
    case Failure::none:
      return "none";
    case Failure::timeout:
      return "no answer";
    case Failure::incomplete:
      return "incomplete answer";
    case Failure::malformed:
      return "answer to something else";
    case Failure::crc:
      return "wrong CRC";
    case Failure::exception:
      return "refused by the device";
    case Failure::disconnected:
      return "connection lost";
  }
  return "";
}

const char* exception_text(int code) {
  switch (code) {
    case 1:
      return "illegal function";
    case 2:
      return "illegal data address";
    case 3:
      return "illegal data value";
    case 4:
      return "device failure";
    case 5:
      return "acknowledged, still working";
    case 6:
      return "device busy";
    case 8:
      return "memory parity error";
    case 10:
      return "gateway path unavailable";
    case 11:
      return "gateway target does not answer";
    default:
      return "unknown exception";
  }
}

Reply read_reply(const Request& request, std::span<const std::uint8_t> pdu) {
  Reply reply;
  const auto fc = static_cast<std::uint8_t>(request.fc);
  if (pdu.size() == 2 && pdu[0] == (fc | 0x80u)) {
    reply.failure = Failure::exception;
    reply.exception = pdu[1];
    return reply;
  }
  reply.failure = Failure::malformed;
  if (pdu.size() != request.reply_pdu_bytes() || pdu[0] != fc) return reply;
  if (request.reads()) {
    if (pdu[1] != 2 * request.count) return reply;
    for (std::size_t i = 2; i < pdu.size(); i += 2) reply.registers.push_back(word_at(pdu, i));
  } else {  // the device repeats what it wrote, and where
    const std::uint16_t echoed = request.fc == 6 ? request.values.at(0) : static_cast<std::uint16_t>(request.values.size());
    if (word_at(pdu, 1) != request.address || word_at(pdu, 3) != echoed) return reply;
  }
  reply.failure = Failure::none;
  return reply;
}

}  // namespace rotorloop::modbus
