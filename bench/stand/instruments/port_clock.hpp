// The monotonic clock that ports are timed with. The only wall clock of this room; nothing in virtual time includes it.
#pragma once
#include <chrono>
#include <cstdint>

namespace rotorloop::modbus {

inline std::int64_t port_clock_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace rotorloop::modbus
