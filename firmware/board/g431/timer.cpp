#include "firmware/board/g431/timer.hpp"

#include "firmware/board/g431/rcc.hpp"

namespace rotorloop::g431 {

using namespace tim_bits;

void prepare_bridge(const BridgeTiming& timing) {
  TimerRegisters& t = tim1();
  t.cr1.write(kCentreAligned | kPreloadTop);
  t.cr2.write(kTrgoUpdate | kTrgo2Oc4);  // idle levels of all outputs: low
  t.psc.write(0);
  t.arr.write(timing.top);
  t.rcr.write(0);
  for (std::size_t k = 0; k < 3; ++k) t.ccr[k].write(0);  // high sides never on
  t.ccr[3].write(1);                                      // OC4REF rises at the trough
  t.ccmr1.write(kAllGateBits.ccmr1);
  t.ccmr2.write(kAllGateBits.ccmr2);
  t.ccer.write(0);
  t.egr.write(kUpdate);  // what is preloaded is in force
  t.sr.write(0);
  // The pin's break input is not connected: only what opens the bridge from inside the chip, and that acts with the break enabled.
  t.af1.write(0);
  t.af2.write(0);
  const std::uint32_t fixed = dead_time_bits(timing.dead_time_ns) | kOssi | kOssr | kBreakOn | kBreakHigh;
  t.bdtr.write(fixed);
  t.bdtr.write(fixed | kLock2);
  t.dier.write(kBreakInterrupt);
}

void start_bridge_timer(const BridgeTiming& timing) {
  tim1().cr1.set(kOn);
  tim1().rcr.write(2 * timing.periods_per_sample - 1);
}

void start_microseconds() {
  rcc().apb1enr1.set(rcc_bits::kTim2);
  TimerRegisters& t = tim2();
  t.psc.write(kCore_Hz / 1'000'000 - 1);
  t.arr.write(0xFFFFFFFF);
  t.egr.write(kUpdate);  // the prescaler is in force
  t.sr.write(0);
  t.cr1.write(kOn);
}

}  // namespace rotorloop::g431
