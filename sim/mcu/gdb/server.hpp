// A TCP port of this machine alone at which a debugger finds the target.
#pragma once
#include <cstdint>
#include <functional>

#include "host/base/descriptor.hpp"
#include "sim/mcu/gdb/target.hpp"

namespace rotorloop::mcu::gdb {

class Server {
 public:
  // Listens on 127.0.0.1; port 0: any that is free. Throws Error (ExitCode::device): the port is taken.
  explicit Server(uint16_t port);
  uint16_t port() const { return port_; }
  // Waits for a debugger, then serves it. The target stands still until the debugger lets it run. Returns true when it detached (the target
  // goes on), false when it killed the target, closed the connection, or stop() became true.
  bool serve(DebugTarget& target, const std::function<bool()>& stop);

 private:
  Descriptor listener_;
  uint16_t port_ = 0;
};

}  // namespace rotorloop::mcu::gdb
