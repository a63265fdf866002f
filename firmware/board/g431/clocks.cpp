#include "firmware/board/g431/flash.hpp"
#include "firmware/board/g431/pwr.hpp"
#include "firmware/board/g431/rcc.hpp"

namespace rotorloop::g431 {
namespace {

// Tries of a loop of some ten cycles at 16 MHz: the crystal takes about 2 ms, the rest microseconds (DS12589).
constexpr std::uint32_t kCrystalTries = 100'000, kShortTries = 10'000;
// At least 1 us at 85 MHz, whatever a turn of the loop takes.
constexpr std::uint32_t kHalvedTurns = 100;

ClockFault start_crystal() {
  rcc().cr.set(rcc_bits::kHseOn);
  return wait_for([] { return rcc().cr.has(rcc_bits::kHseReady); }, kCrystalTries) ? ClockFault::none : ClockFault::crystal;
}

ClockFault start_pll() {
  rcc().pllcfgr.write(3u | field(kPllM - 1, 4) | field(kPllN, 8) | bit(24) | field(kPllR / 2 - 1, 25));  // from the crystal; output R alone
  rcc().cr.set(rcc_bits::kPllOn);
  return wait_for([] { return rcc().cr.has(rcc_bits::kPllReady); }, kShortTries) ? ClockFault::none : ClockFault::pll;
}

ClockFault boost_regulator() {
  pwr().cr1.change(pwr_bits::kVosMask, pwr_bits::kVosRange1);
  if (!wait_for([] { return !pwr().sr2.has(pwr_bits::kVosChanging); }, kShortTries)) return ClockFault::regulator;
  pwr().cr5.clear(pwr_bits::kNotBoost);
  return ClockFault::none;
}

ClockFault switch_to_pll() {
  rcc().cfgr.change(rcc_bits::kHpreMask, rcc_bits::kHpreHalf);
  rcc().cfgr.change(rcc_bits::kSwMask, rcc_bits::kSwPll);
  const bool switched =
      wait_for([] { return (rcc().cfgr.read() >> rcc_bits::kSwsShift & rcc_bits::kSwMask) == rcc_bits::kSwPll; }, kShortTries);
  wait_for([] { return !rcc().cfgr.has(rcc_bits::kHpreHalf); }, kHalvedTurns);  // runs out: that is the pause
  rcc().cfgr.clear(rcc_bits::kHpreMask);
  return switched ? ClockFault::none : ClockFault::not_switched;
}

}  // namespace

ClockFault start_clocks() {
  rcc().apb1enr1.set(rcc_bits::kPwr);
  ClockFault fault = boost_regulator();
  if (fault == ClockFault::none && !set_wait_states(kWaitStates)) fault = ClockFault::flash;
  if (fault == ClockFault::none) fault = start_crystal();
  if (fault == ClockFault::none) fault = start_pll();
  return fault == ClockFault::none ? switch_to_pll() : fault;
}

void watch_crystal() { rcc().cr.set(rcc_bits::kCssOn); }

}  // namespace rotorloop::g431
