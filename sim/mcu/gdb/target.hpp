// What a debugger holds: a core with memory, that runs for a while or for one instruction.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu::gdb {

enum class Halt : uint8_t {
  none,        // the cycles are over
  breakpoint,  // BKPT
  locked_up,
  error,  // the chip refused an access: message() says which
  stopped,
};

class DebugTarget {
 public:
  virtual ~DebugTarget() = default;
  virtual Core& core() = 0;
  // Memory and registers of peripherals, as the program sees them. False: nothing is there. Writes reach flash too.
  virtual bool read(uint32_t address, std::span<uint8_t> bytes) = 0;
  virtual bool write(uint32_t address, std::span<const uint8_t> bytes) = 0;
  virtual Halt run_for(uint64_t cycles) = 0;
  virtual Halt step() = 0;
  virtual void reset() = 0;
  virtual std::string message() const { return {}; }  // of the last Halt::error
};

}  // namespace rotorloop::mcu::gdb
