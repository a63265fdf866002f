// Power control (RM0440, section 6), the system configuration (section 10) and the debug freeze (section 47): what is set once.
#pragma once
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct PwrRegisters {
  Register cr1, cr2, cr3, cr4, sr1, sr2, scr;
  Reserved<1> reserved_1c;
  Register pull[16];  // PUCRA, PDCRA, …
  Reserved<8> reserved_60;
  Register cr5;
};
static_assert(offsetof(PwrRegisters, cr3) == 0x08 && offsetof(PwrRegisters, sr2) == 0x14 && offsetof(PwrRegisters, pull) == 0x20 &&
              offsetof(PwrRegisters, cr5) == 0x80);
inline PwrRegisters& pwr() { return block<PwrRegisters, 0x40007000>(); }

namespace pwr_bits {
inline constexpr std::uint32_t kUcpdDeadBatteryOff = bit(14);                                             // CR3
inline constexpr std::uint32_t kVosMask = field(3, 9), kVosRange1 = field(1, 9), kVosChanging = bit(10);  // CR1, SR2
inline constexpr std::uint32_t kNotBoost = bit(8);                                                        // CR5
inline constexpr std::uint32_t kPvdOn = bit(0), kPvdLevel2V9 = field(6, 1);                               // CR2: falling 2.85 V
}  // namespace pwr_bits

struct SyscfgRegisters {
  Register memrmp, cfgr1, exticr[4], scsr, cfgr2, swpr, skr;
};
static_assert(offsetof(SyscfgRegisters, exticr) == 0x08 && offsetof(SyscfgRegisters, cfgr2) == 0x1C);
inline SyscfgRegisters& syscfg() { return block<SyscfgRegisters, 0x40010000>(); }

// What opens the bridge without software, through TIM1's system break: lock-up of the core, RAM parity, supply below the PVD's level,
// double ECC error of the flash.
namespace syscfg_bits {
inline constexpr std::uint32_t kLockupBreaks = bit(0), kParityBreaks = bit(1), kPvdBreaks = bit(2), kEccBreaks = bit(3);
}

struct DbgmcuRegisters {
  Register idcode, cr, apb1fzr1, apb1fzr2, apb2fzr;
};
static_assert(offsetof(DbgmcuRegisters, apb2fzr) == 0x10);
inline DbgmcuRegisters& dbgmcu() { return block<DbgmcuRegisters, 0xE0042000>(); }
namespace dbgmcu_bits {
inline constexpr std::uint32_t kTim1Stops = bit(11);  // APB2FZR: counter stops and the outputs go off while the core is halted
inline constexpr std::uint32_t kWwdgStops = bit(11), kIwdgStops = bit(12), kTim2Stops = bit(0);  // APB1FZR1
}  // namespace dbgmcu_bits

}  // namespace rotorloop::g431
