// What the board does after a reset, write by write: nothing may go wrong while a gate is open.
#include "firmware/app/b_g431b_esc1/board.hpp"
#include "test/unit/firmware/g431/chip_fake.hpp"

namespace rotorloop::b_g431b_esc1 {
namespace {

using namespace g431;

class Start : public ChipFake {
 protected:
  Start() {
    hold_gates_low();
    gates_held = writes.size();
    report = board.start();
  }
  std::size_t last_pin_given_to_timer() const {
    std::size_t last = 0;
    for (const GatePin& g : kGates) {
      Register& moder = gpio(g.pin.port).moder;
      last = std::max(last, first([&](const Write& w) { return w.at == &moder && (w.value >> (2 * g.pin.number) & 3u) == 2u; }));
    }
    return last;
  }
  EscBoard board;
  std::size_t gates_held = 0;
  StartReport report;
};

class StartWithoutCrystal : public Start {
 protected:
  StartWithoutCrystal() {
    writes.clear();
    clear(rcc(), tim1());
    crystal_starts = false;
    report = EscBoard().start();
  }
};

TEST_F(Start, AllSixGatesAreOutputsAtLowLevelBeforeAnyOtherRegisterThanTheClockOfThePortsIsWritten) {
  const std::array<const GpioRegisters*, 3> ports{&gpio_a(), &gpio_b(), &gpio_c()};
  for (std::size_t i = 0; i < gates_held; ++i) {
    const Register* at = writes[i].at;
    const bool of_port = std::any_of(ports.begin(), ports.end(), [&](const GpioRegisters* p) { return at == &p->bsrr || at == &p->moder; });
    EXPECT_TRUE(of_port || at == &rcc().ahb2enr) << "write " << i;
  }
  for (const GatePin& g : kGates) {
    const GpioRegisters& port = gpio(g.pin.port);
    const std::size_t low = first_with(port.bsrr, bit(g.pin.number + 16u));
    const std::size_t output = first([&](const Write& w) { return w.at == &port.moder && (w.value >> (2 * g.pin.number) & 3u) == 1u; });
    EXPECT_LT(low, output);
    EXPECT_LT(output, gates_held);
  }
}

TEST_F(Start, DeadBatteryPullDownsOfTheUsbBlockAreOffBeforeTheClocksChange) {
  EXPECT_LT(first_with(pwr().cr3, pwr_bits::kUcpdDeadBatteryOff), first_with(rcc().cr, rcc_bits::kHseOn));
}

TEST_F(Start, At170MHzThereAre4WaitStatesAndTheBoostBeforeTheSwitchAndAhbIsHalvedOverIt) {
  ASSERT_EQ(report.clocks, ClockFault::none);
  const std::size_t switched = first_with(rcc().cfgr, rcc_bits::kSwPll);
  const std::size_t wait_states = first([](const Write& w) { return w.at == &flash_registers().acr && (w.value & 15u) == 4u; });
  EXPECT_LT(wait_states, switched);
  EXPECT_LT(first([](const Write& w) { return w.at == &pwr().cr5 && (w.value & pwr_bits::kNotBoost) == 0; }), switched);
  EXPECT_EQ(writes[switched].value & rcc_bits::kHpreMask, rcc_bits::kHpreHalf);
  EXPECT_EQ(rcc().cfgr.peek() & rcc_bits::kHpreMask, 0u);
  const std::uint32_t pll = rcc().pllcfgr.peek();
  EXPECT_EQ((pll >> 4 & 15u) + 1, 2u);
  EXPECT_EQ(pll >> 8 & 127u, 85u);
  EXPECT_EQ(pll >> 25 & 3u, 0u);  // divided by 2
}

TEST_F(Start, ThePinsGoToTheTimerOnlyWhenItsOutputsAreOffIdleLowAndItsBreakIsArmed) {
  const std::size_t given = last_pin_given_to_timer();
  const std::uint32_t armed = tim_bits::kOssi | tim_bits::kOssr | tim_bits::kBreakOn | tim_bits::kBreakHigh | tim_bits::kLock2;
  EXPECT_LT(first_with(tim1().bdtr, armed), given);
  EXPECT_GT(first_with(tim1().bdtr, tim_bits::kMainOutput), given);
  EXPECT_EQ(tim1().cr2.peek() & 0x3F00u, 0u) << "idle levels";
  const std::uint32_t causes = syscfg_bits::kLockupBreaks | syscfg_bits::kParityBreaks | syscfg_bits::kPvdBreaks | syscfg_bits::kEccBreaks;
  EXPECT_LT(first_with(syscfg().cfgr2, causes), given);
  EXPECT_LT(first_with(dbgmcu().apb2fzr, dbgmcu_bits::kTim1Stops), given);
}

TEST_F(Start, BootstrapIsChargedFor10MsByLowSidesAloneAndTheBridgeIsOffAfterIt) {
  const std::size_t on = first_with(tim1().bdtr, tim_bits::kMainOutput);
  ASSERT_LT(on, writes.size());
  EXPECT_EQ(tim1().ccer.peek(), 0x444u) << "only CCxNE";
  EXPECT_FALSE(bridge_is_on());
  const std::size_t fed = static_cast<std::size_t>(
      std::count_if(writes.begin() + static_cast<std::ptrdiff_t>(on), writes.end(), [](const Write& w) { return w.at == &iwdg().kr; }));
  EXPECT_NEAR(static_cast<double>(fed), 10'000.0, 10.0) << "one look at the clock takes a microsecond here";
}

TEST_F(Start, NoInterruptIsEnabledAndTheWatchdogOfSamplesSleepsBeforeSamplingStarts) {
  EXPECT_EQ(first([](const Write& w) { return w.at == &nvic().iser[0] || w.at == &wwdg().cr; }), writes.size());
  board.start_sampling();
  EXPECT_EQ(wwdg().cr.peek(), 0x80u | kWwdgFull);
}

TEST_F(StartWithoutCrystal, TheBridgeIsNeverOnAndTheProgramsWatchdogRuns) {
  EXPECT_EQ(report.clocks, ClockFault::crystal);
  EXPECT_FALSE(report.ok());
  EXPECT_EQ(first_with(tim1().bdtr, tim_bits::kMainOutput), writes.size());
  EXPECT_NE(first_with(iwdg().kr, 0xCCCC), writes.size());
}

TEST_F(Start, AParameterPageIsNotErasedWhileTheBridgeIsOn) {
  board.bridge_on();
  EXPECT_FALSE(board.flash_erase(0));
  EXPECT_FALSE(board.flash_program(0, 0, 1));
  board.bridge_off();
  EXPECT_TRUE(board.flash_erase(0));
}

TEST_F(Start, TheProgramsWatchdogIsFedOnlyAtTheEndOfATurnThatAskedForIt) {
  const auto feeds = [&] {
    return std::count_if(writes.begin(), writes.end(), [](const Write& w) { return w.at == &iwdg().kr && w.value == 0xAAAA; });
  };
  const auto before = feeds();
  board.end_of_turn();
  EXPECT_EQ(feeds(), before);
  board.kick_watchdog();
  EXPECT_EQ(feeds(), before);
  board.end_of_turn();
  EXPECT_EQ(feeds(), before + 1);
  board.end_of_turn();
  EXPECT_EQ(feeds(), before + 1);
}

TEST_F(Start, CountsComeFromTheRightConverterAndTheBusVoltageFollowsTheReference) {
  adc1().jdr[0].hardware(2001);
  adc2().jdr[0].hardware(2002);
  adc1().jdr[1].hardware(2003);
  const firmware::AdcCounts counts = board.adc();
  EXPECT_EQ(counts.phase, (std::array<std::uint16_t, 3>{2001, 2002, 2003}));
}

}  // namespace
}  // namespace rotorloop::b_g431b_esc1
