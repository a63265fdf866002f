// A chip whose program waits for interrupts for ever, and accesses to its registers as a program makes them.
#pragma once
#include <gtest/gtest.h>

#include <cstring>

#include "sim/mcu/g431/blocks.hpp"
#include "sim/mcu/g431/chip.hpp"

namespace rotorloop::mcu::g431::testing {

inline constexpr uint32_t kRcc = 0x40021000;

class Bench {
 public:
  Bench() {
    // Vectors: stack, entry; every handler is BX LR. The program: WFI, and a branch back to it.
    word(0, kSramBase + kSramBytes);
    for (uint32_t n = 1; n < 118; ++n) word(4 * n, kFlashBase + 0x201);
    word(4, kFlashBase + 0x211);
    word(0x200, 0x00004770);
    word(0x210, 0xE7FDBF30);
    chip.power_up();
  }
  void word(uint32_t offset, uint32_t value) { std::memcpy(&chip.flash()[offset], &value, 4); }

  void write(uint32_t address, uint32_t value, uint32_t bytes = 4) {
    EXPECT_TRUE(chip.write(address, bytes, value)) << std::hex << address;
  }
  uint32_t read(uint32_t address, uint32_t bytes = 4) {
    uint32_t value = 0;
    EXPECT_TRUE(chip.read(address, bytes, value)) << std::hex << address;
    return value;
  }
  void set(uint32_t address, uint32_t bits) { write(address, read(address) | bits); }
  void clear(uint32_t address, uint32_t bits) { write(address, read(address) & ~bits); }
  End run_us(double us) { return chip.run_until(chip.cycle() + static_cast<uint64_t>(us * 1e-6 * chip.clocks().hclk_Hz + 0.5)); }
  End run_cycles(uint64_t cycles) { return chip.run_until(chip.cycle() + cycles); }
  // 170 MHz from the 8 MHz crystal; every block clocked.
  void run_at_170_MHz() {
    set(kRcc, 1u << 16);
    run_us(2500);
    write(kRcc + 0x0C, 3u | 1u << 4 | 85u << 8 | 1u << 24);
    set(kRcc, 1u << 24);
    run_us(100);
    write(kRcc + 0x08, 3);
    clock_everything();
  }
  void clock_everything() {
    for (const uint32_t r : {0x48, 0x4C, 0x50, 0x58, 0x5C, 0x60}) write(kRcc + r, 0xFFFFFFFF);
  }
  bool pending(uint32_t line) { return chip.core().state.nvic.pending.has(kFirstInterrupt + line); }
  bool line(uint32_t n) { return chip.core().state.nvic.line.has(kFirstInterrupt + n); }

  Chip chip;
};

}  // namespace rotorloop::mcu::g431::testing
