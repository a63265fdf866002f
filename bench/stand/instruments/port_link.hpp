// A serial port or a TCP connection as a ByteLink. libmodbus opens it and sets it up (rates, parity, raw mode, TCP options); the bytes are
// ours, since its reads wait on a clock of their own, do not say when a byte came and forget what a time-out left behind.
#pragma once
#include <memory>
#include <string>

#include "bench/stand/instruments/byte_link.hpp"
#include "bench/stand/instruments/profile.hpp"

struct _modbus;

namespace rotorloop::modbus {

// "rtu:/dev/ttyUSB0", "/dev/ttyUSB0", "tcp:192.168.1.9:502", "tcp:host" (port 502).
struct PortName {
  bool tcp = false;
  std::string path;  // RTU: the device; TCP: the host
  int port = 502;
};
// Throws Error (usage), with `where` as its place.
PortName parse_port(const std::string& text, const std::string& where);

class PortLink : public ByteLink {
 public:
  // Opens at once; throws Error (device) when that fails, naming the port, the likely cause and what to do.
  PortLink(const PortName& port, const SerialFormat& format);
  ~PortLink() override;
  PortLink(const PortLink&) = delete;
  PortLink& operator=(const PortLink&) = delete;

  std::int64_t now_ns() override;
  bool send(std::span<const std::uint8_t> bytes) override;
  int receive(std::span<std::uint8_t> into, std::int64_t deadline_ns) override;
  bool connected() const { return fd_ >= 0; }
  // Whether a USB adapter was asked to pass bytes on at once; FTDI adapters hold them for 16 ms otherwise.
  bool low_latency() const { return low_latency_; }

 private:
  bool open();
  void close();
  PortName port_;
  SerialFormat format_;
  _modbus* context_ = nullptr;
  int fd_ = -1;
  int last_errno_ = 0;
  bool low_latency_ = false;
  std::int64_t next_try_ns_ = 0;
};

}  // namespace rotorloop::modbus
