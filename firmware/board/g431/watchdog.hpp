// The two watchdogs (RM0440, sections 43 and 44). IWDG has a clock of its own and resets a chip whose program hangs; WWDG counts the bus
// clock and resets one whose sample interrupt has stopped. A reset is what opens the bridge: the pins float and the drivers pull down.
#pragma once
#include "firmware/board/g431/rcc.hpp"
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct IwdgRegisters {
  Register kr, pr, rlr, sr, winr;
};
static_assert(offsetof(IwdgRegisters, winr) == 0x10);
inline IwdgRegisters& iwdg() { return block<IwdgRegisters, 0x40003000>(); }

struct WwdgRegisters {
  Register cr, cfr, sr;
};
static_assert(sizeof(WwdgRegisters) == 12);
inline WwdgRegisters& wwdg() { return block<WwdgRegisters, 0x40002C00>(); }

// LSI is 29.5 to 34 kHz (DS12589): longer than the erase of a page, 25 ms, and than the 50 ms that a program may take, at the fast end.
inline constexpr std::uint32_t kLsiFastest_Hz = 34'000, kLsiSlowest_Hz = 29'500, kIwdgDivider = 16, kIwdgReload = 119;
static_assert((kIwdgReload + 1) * kIwdgDivider * 1000 / kLsiFastest_Hz >= 50 &&
              (kIwdgReload + 1) * kIwdgDivider * 1000 / kLsiSlowest_Hz <= 100);

inline void feed_iwdg() { iwdg().kr.write(0xAAAA); }
inline void start_iwdg(std::uint32_t reload = kIwdgReload) {
  iwdg().kr.write(0xCCCC);
  iwdg().kr.write(0x5555);
  iwdg().pr.write(2);  // / 16
  iwdg().rlr.write(reload);
  wait_for([] { return iwdg().sr.read() == 0; }, 100'000);
  feed_iwdg();
}

// Counts of 4096 cycles of the bus clock from `kWwdgFull` down to 0x3F.
inline constexpr std::uint32_t kWwdgOn = bit(7), kWwdgFull = 0x7D, kWwdgLast = 0x3F;
inline constexpr std::uint32_t kWwdg_us = (kWwdgFull - kWwdgLast) * 4096ull * 1'000'000 / kCore_Hz;
static_assert(kWwdg_us <= 1500 && kWwdg_us >= 1400);

[[gnu::always_inline]] inline void feed_wwdg() { wwdg().cr.write(kWwdgOn | kWwdgFull); }
// Cannot be stopped again.
inline void start_wwdg() {
  rcc().apb1enr1.set(rcc_bits::kWwdg);
  wwdg().cfr.write(0x7F);  // no window: it may be fed early; clock not divided further
  feed_wwdg();
}

}  // namespace rotorloop::g431
