// Emulated devices on a real port: a pseudo-terminal, a serial port, or TCP on this machine alone. Answers come after the device's
// turnaround; on a pseudo-terminal, which knows no baud rate, bytes are paced as a line would.
#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <vector>

#include "bench/stand/instruments/slave_device.hpp"

namespace rotorloop::modbus {

struct ServedDevice {
  std::uint8_t id = 1;
  std::shared_ptr<Slave> slave;
  std::int64_t turnaround_ns = 2'000'000;
};

class PortServer {
 public:
  struct Counts {
    std::uint64_t requests = 0, answered = 0, refused = 0, damaged = 0;
  };
  virtual ~PortServer() = default;
  // Serves until `stop` is set or the time of port_clock has come; looks at `stop` every 50 ms.
  virtual void serve(const std::vector<ServedDevice>& devices, const std::atomic<bool>& stop, std::int64_t until_ns) = 0;
  virtual std::string where() const = 0;  // what a client opens
  const Counts& counts() const { return counts_; }

 protected:
  Counts counts_;
};

// `path` that does not exist: becomes a link to a new pseudo-terminal, removed in the end. A terminal: is opened. Throws Error (device).
std::unique_ptr<PortServer> serve_rtu(const std::filesystem::path& path, const SerialFormat& format);
// 127.0.0.1, never another interface. Port 0: any free one, see where(). Throws Error (device).
std::unique_ptr<PortServer> serve_tcp(int port);

}  // namespace rotorloop::modbus
