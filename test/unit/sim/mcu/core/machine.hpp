// A core with 64 KB of flash, 32 KB of SRAM and a bus on which nothing answers but one register: what the tests of the core stand on.
#pragma once
#include <cstdint>
#include <initializer_list>
#include <map>
#include <vector>

#include "sim/mcu/core/core.hpp"

namespace rotorloop::mcu::testing {

inline constexpr uint32_t kFlash = 0x08000000, kRam = 0x20000000, kStack = kRam + 0x4000, kProcessStack = kRam + 0x2000;
inline constexpr uint32_t kProgram = kFlash + 0x400;    // where programs of tests start
inline constexpr uint32_t kHandlers = kFlash + 0x2000;  // handler of exception n: 64 n bytes further
inline constexpr uint32_t kNop = 0xBF00;
inline constexpr uint32_t kRegister = 0x40000000;  // a peripheral's register that can be read and written

class Machine : public Bus {
 public:
  Machine() : flash(0x10000), ram(0x8000), core(map(), *this) {
    word(kFlash, kStack);
    for (uint32_t n = 1; n < 128; ++n) word(kFlash + 4 * n, handler(n) | 1);
    word(kFlash + 4, kProgram | 1);
    for (uint32_t n = 2; n < 128; ++n) code(handler(n), {0x4770});  // BX LR
    core.reset(kFlash);
  }
  static uint32_t handler(uint32_t exception) { return kHandlers + 64 * exception; }

  void word(uint32_t address, uint32_t value) { std::memcpy(place(address), &value, 4); }
  uint32_t word(uint32_t address) {
    uint32_t value = 0;
    std::memcpy(&value, place(address), 4);
    return value;
  }
  // Halfwords of instructions; 32-bit instructions are two, the first one first.
  void code(uint32_t address, std::initializer_list<uint32_t> halfwords) {
    for (const uint32_t h : halfwords) {
      const auto half = static_cast<uint16_t>(h);
      std::memcpy(place(address), &half, 2);
      core.code_changed(address, 2);
      address += 2;
    }
  }
  void program(std::initializer_list<uint32_t> halfwords) { code(kProgram, halfwords); }
  // Registers of the system space, as privileged code writes and reads them.
  void system(uint32_t address, uint32_t value) { core.write_system(address, 4, value); }
  uint32_t system(uint32_t address) {
    uint32_t value = 0;
    core.read_system(address, 4, value);
    return value;
  }
  void enable_interrupt(uint32_t n, uint32_t priority) {
    system(0xE000E100 + n / 32 * 4, 1u << (n % 32));
    core.state.nvic.priority[kFirstInterrupt + n] = static_cast<uint8_t>(priority);
  }
  // Until so many instructions are executed.
  void instructions(uint64_t count) {
    const uint64_t until = core.state.instructions + count;
    while (core.state.instructions < until && !core.state.locked_up) core.run_until(core.cycle() + 1);
  }
  // Until the core is about to execute the instruction at an address; false: not within 10 000 cycles.
  bool run_to(uint32_t address) {
    for (const uint64_t end = core.cycle() + 10000; core.cycle() < end && !core.state.locked_up; core.run_until(core.cycle() + 1))
      if (core.state.r[kPc] == address && core.state.phase == Phase::running) return true;
    return false;
  }

  bool read(uint32_t address, uint32_t, uint32_t& value) override {
    if (address != kRegister) return false;
    value = last_written;
    return true;
  }
  bool write(uint32_t address, uint32_t, uint32_t value) override {
    if (address != kRegister) return false;
    last_written = value;
    return true;
  }

  std::vector<uint8_t> flash, ram;
  MemoryMap memories;
  uint32_t last_written = 0;
  Core core;

 private:
  MemoryMap& map() {
    memories.add({flash.data(), kFlash, static_cast<uint32_t>(flash.size()), false, true, false});
    memories.add({ram.data(), kRam, static_cast<uint32_t>(ram.size()), true, false, false});
    return memories;
  }
  uint8_t* place(uint32_t address) { return address >= kRam ? &ram.at(address - kRam) : &flash.at(address - kFlash); }
};

}  // namespace rotorloop::mcu::testing
