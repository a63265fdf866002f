// The seam between the master and the world: a clock and a stream of bytes with deadlines. Everything that decides whether a value is
// accepted (framing, CRC, gaps, time-outs, silence after errors, time stamps) stands above it and runs alike on a port and in virtual time.
#pragma once
#include <cstdint>
#include <span>

namespace rotorloop::modbus {

class ByteLink {
 public:
  virtual ~ByteLink() = default;
  virtual std::int64_t now_ns() = 0;
  // Puts the bytes on their way and returns; false when the connection is gone (the next send tries to get it back).
  virtual bool send(std::span<const std::uint8_t> bytes) = 0;
  // Waits until bytes are there or the deadline has come: how many, 0 at the deadline. A deadline that has passed asks only for what is
  // there. Negative: the connection is gone.
  virtual int receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) = 0;
};

}  // namespace rotorloop::modbus
