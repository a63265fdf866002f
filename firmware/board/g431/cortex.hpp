// The core's own registers (ARMv7-M architecture reference manual, chapter B3): interrupts, faults, memory protection, cycle counter.
#pragma once
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct ScbRegisters {
  Register cpuid, icsr, vtor, aircr, scr, ccr, shpr[3], shcsr, cfsr, hfsr, dfsr, mmfar, bfar, afsr;
  Reserved<18> reserved_40;
  Register cpacr;
};
static_assert(offsetof(ScbRegisters, vtor) == 0x08 && offsetof(ScbRegisters, shcsr) == 0x24 && offsetof(ScbRegisters, bfar) == 0x38 &&
              offsetof(ScbRegisters, cpacr) == 0x88);
inline ScbRegisters& scb() { return block<ScbRegisters, 0xE000ED00>(); }

struct NvicRegisters {
  Register iser[8];
  Reserved<24> reserved_20;
  Register icer[8];
  Reserved<24> reserved_a0;
  Register ispr[8];
  Reserved<24> reserved_120;
  Register icpr[8];
  Reserved<24> reserved_1a0;
  Register iabr[8];
  Reserved<56> reserved_220;
  Register ipr[60];
};
static_assert(offsetof(NvicRegisters, icer) == 0x80 && offsetof(NvicRegisters, iabr) == 0x200 && offsetof(NvicRegisters, ipr) == 0x300);
inline NvicRegisters& nvic() { return block<NvicRegisters, 0xE000E100>(); }

struct MpuRegisters {
  Register type, ctrl, rnr, rbar, rasr;
};
static_assert(offsetof(MpuRegisters, rasr) == 0x10);
inline MpuRegisters& mpu() { return block<MpuRegisters, 0xE000ED90>(); }

struct DwtRegisters {
  Register ctrl, cyccnt;
};
inline DwtRegisters& dwt() { return block<DwtRegisters, 0xE0001000>(); }
inline Register& demcr() { return block<Register, 0xE000EDFC>(); }

// Interrupt numbers (RM0440, table 97).
inline constexpr std::uint32_t kIrqAdc12 = 18, kIrqFdcan0 = 21, kIrqTim1Break = 24, kIrqPvd = 1, kInterrupts = 102;

// 0 is the highest of 16.
inline void enable_interrupt(std::uint32_t number, std::uint32_t priority) {
  const unsigned at = 8u * (number % 4u);
  nvic().ipr[number / 4].change(field(0xFF, at), field(priority << 4u, at));
  nvic().iser[number / 32].write(bit(number % 32u));
}

inline void enable_fpu() { scb().cpacr.set(field(15, 20)); }
inline void enable_faults() { scb().shcsr.set(bit(16) | bit(17) | bit(18)); }  // memory, bus, usage: each with a vector of its own
inline void count_cycles() {
  demcr().set(bit(24));
  dwt().ctrl.set(bit(0));
}
inline void request_reset() { scb().aircr.write(0x05FA0004); }

// A region that nothing may touch. `bytes` is a power of two from 32 on, `address` a multiple of it.
inline void forbid(std::uint32_t region, std::uint32_t address, std::uint32_t bytes) {
  std::uint32_t log2 = 5;
  while ((1u << log2) < bytes) ++log2;
  mpu().rnr.write(region);
  mpu().rbar.write(address);
  mpu().rasr.write(bit(28) | field(log2 - 1, 1) | 1u);  // no instructions, no access
}
inline void enable_mpu() { mpu().ctrl.write(bit(2) | bit(1) | bit(0)); }  // the default map elsewhere; in fault handlers too

#ifdef __arm__
inline void mask_interrupts() { __asm__ volatile("cpsid i" ::: "memory"); }
inline void allow_interrupts() { __asm__ volatile("cpsie i" ::: "memory"); }
inline void wait_for_interrupt() { __asm__ volatile("wfi" ::: "memory"); }
inline void synchronise() { __asm__ volatile("dsb\n isb" ::: "memory"); }
#else
inline void mask_interrupts() {}
inline void wait_for_interrupt() {}
inline void allow_interrupts() {}
inline void synchronise() {}
#endif

}  // namespace rotorloop::g431
