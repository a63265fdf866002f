// Clocks (RM0440, section 7): which blocks run, the tree from the crystal of 8 MHz to 170 MHz, its watch, and why the chip was reset.
#pragma once
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct RccRegisters {
  Register cr, icscr, cfgr, pllcfgr;
  Reserved<2> reserved_10;
  Register cier, cifr, cicr;
  Reserved<1> reserved_24;
  Register ahb1rstr, ahb2rstr, ahb3rstr;
  Reserved<1> reserved_34;
  Register apb1rstr1, apb1rstr2, apb2rstr;
  Reserved<1> reserved_44;
  Register ahb1enr, ahb2enr, ahb3enr;
  Reserved<1> reserved_54;
  Register apb1enr1, apb1enr2, apb2enr;
  Reserved<1> reserved_64;
  Register ahb1smenr, ahb2smenr, ahb3smenr;
  Reserved<1> reserved_74;
  Register apb1smenr1, apb1smenr2, apb2smenr;
  Reserved<1> reserved_84;
  Register ccipr;
  Reserved<1> reserved_8c;
  Register bdcr, csr, crrcr, ccipr2;
};
static_assert(offsetof(RccRegisters, cicr) == 0x20 && offsetof(RccRegisters, ahb1rstr) == 0x28 &&
              offsetof(RccRegisters, apb2rstr) == 0x40 && offsetof(RccRegisters, ahb1enr) == 0x48 &&
              offsetof(RccRegisters, ahb2enr) == 0x4C && offsetof(RccRegisters, apb1enr1) == 0x58 &&
              offsetof(RccRegisters, apb2enr) == 0x60 && offsetof(RccRegisters, ccipr) == 0x88 && offsetof(RccRegisters, csr) == 0x94 &&
              sizeof(RccRegisters) == 0xA0);
inline RccRegisters& rcc() { return block<RccRegisters, 0x40021000>(); }

namespace rcc_bits {
inline constexpr std::uint32_t kHsiOn = bit(8), kHseOn = bit(16), kHseReady = bit(17), kCssOn = bit(19), kPllOn = bit(24),
                               kPllReady = bit(25);
inline constexpr std::uint32_t kSwMask = 3, kSwHsi = 1, kSwHse = 2, kSwPll = 3, kSwsShift = 2;
inline constexpr std::uint32_t kHpreMask = field(15, 4), kHpreHalf = field(8, 4);
inline constexpr std::uint32_t kCssFailed = bit(8), kCssClear = bit(8);  // CIFR, CICR
inline constexpr std::uint32_t kLsiOn = bit(0), kLsiReady = bit(1), kClearResetFlags = bit(23);
// AHB1ENR, AHB2ENR, APB1ENR1, APB2ENR
inline constexpr std::uint32_t kDma1 = bit(0), kDmamux = bit(2), kFlash = bit(8), kCrc = bit(12);
inline constexpr std::uint32_t kGpioA = bit(0), kGpioB = bit(1), kGpioC = bit(2), kGpioF = bit(5), kAdc12 = bit(13);
inline constexpr std::uint32_t kTim2 = bit(0), kWwdg = bit(11), kUsart2 = bit(17), kFdcan = bit(25), kPwr = bit(28);
inline constexpr std::uint32_t kSyscfg = bit(0), kTim1 = bit(11);
inline constexpr std::uint32_t kFdcanFromPclk1 = field(2, 24), kFdcanMask = field(3, 24);  // CCIPR
}  // namespace rcc_bits

inline constexpr std::uint32_t kCrystal_Hz = 8'000'000;
inline constexpr std::uint32_t kPllM = 2, kPllN = 85, kPllR = 2;
inline constexpr std::uint32_t kCore_Hz = kCrystal_Hz / kPllM * kPllN / kPllR;  // of the core, both APB and every timer
static_assert(kCore_Hz == 170'000'000);
inline constexpr std::uint32_t kAfterReset_Hz = 16'000'000;
// RM0440 table 29: range 1 boost, up to 170 MHz.
inline constexpr std::uint32_t kWaitStates = 4;

enum class ClockFault : std::uint8_t { none, crystal, pll, not_switched, flash, regulator };

// From the reset's 16 MHz to 170 MHz: regulator to boost, wait states, crystal, PLL; then the switch with AHB halved for 1 us, as the
// manual wants above 80 MHz (RM0440, section 6.1.5, range 1 boost). What fails leaves the chip on its 16 MHz.
ClockFault start_clocks();
// An NMI, and TIM1's break in hardware, when the crystal stops (clock security system).
void watch_crystal();

}  // namespace rotorloop::g431
