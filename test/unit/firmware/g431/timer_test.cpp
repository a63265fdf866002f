// The modulator: dead time, modes of the channels, compares; the clock of microseconds; the watchdogs' times.
#include "test/unit/firmware/g431/chip_fake.hpp"

namespace rotorloop::g431 {
namespace {

class Timer : public ChipFake {};

TEST_F(Timer, DeadTimeIsNeverShorterThanAskedForAndAtMost8TicksLonger) {
  for (std::uint32_t ns = 50; ns <= 2500; ns += 10) {
    const std::uint32_t made_ns = dead_time_ticks(dead_time_bits(ns)) * 1000 / 170;
    EXPECT_GE(made_ns + 1, ns);
    EXPECT_LE(made_ns, ns + 8 * 1000 / 170) << ns;
  }
  EXPECT_EQ(dead_time_ticks(dead_time_bits(800)), 136u);  // 800 ns
  static_assert(dead_time_bits(1) > 0);
}

TEST_F(Timer, ALowSideAloneRunsInTheOppositePwmModeBecauseItFollowsTheReferenceUncomplemented) {
  const GateBits both = gate_bits(firmware::kAllGates);
  EXPECT_EQ(both.ccer, 0x555u);
  EXPECT_EQ(both.ccmr1, 0x6868u);
  const GateBits low_of_v = gate_bits(firmware::low_gate(1));
  EXPECT_EQ(low_of_v.ccer, 0x040u);
  EXPECT_EQ(low_of_v.ccmr1, 0x7868u);
  const GateBits high_of_w = gate_bits(firmware::high_gate(2));
  EXPECT_EQ(high_of_w.ccer, 0x100u);
  EXPECT_EQ(high_of_w.ccmr2 & 0xFFu, 0x68u);
}

TEST_F(Timer, ModesAndEnablesChangeOnlyWhileTheMainOutputIsOff) {
  write_gates(kAllGateBits);
  on_write = [](Register& r, std::uint32_t) {
    if (&r == &tim1().ccmr1 || &r == &tim1().ccmr2 || &r == &tim1().ccer) {
      EXPECT_FALSE((tim1().bdtr.peek() & tim_bits::kMainOutput) != 0);
    }
  };
  for (const std::uint8_t mask : std::initializer_list<std::uint8_t>{0x08, 0x3F, 0x38, 0x01, 0x3F}) {
    write_gates(gate_bits(mask));
    EXPECT_TRUE(bridge_is_on());
  }
}

TEST_F(Timer, PreparedItStandsStillWithEveryOutputOffAndCannotBeUnlocked) {
  prepare_bridge({.top = 1771, .periods_per_sample = 2, .dead_time_ns = 800});
  EXPECT_EQ(tim1().cr1.peek() & tim_bits::kOn, 0u);
  EXPECT_EQ(tim1().ccer.peek(), 0u);
  EXPECT_EQ(tim1().bdtr.peek() & (tim_bits::kMainOutput | tim_bits::kLock2), tim_bits::kLock2);
  EXPECT_EQ(tim1().bdtr.peek() & 0xFFu, dead_time_bits(800));
  EXPECT_EQ(tim1().ccr[0].peek(), 0u) << "high sides never on";
}

TEST_F(Timer, TheFirstUpdateComesAtACrestAndEveryOtherCrestAfterIt) {
  const BridgeTiming timing{.top = 1771, .periods_per_sample = 2, .dead_time_ns = 800};
  prepare_bridge(timing);
  EXPECT_EQ(tim1().rcr.peek(), 0u) << "the first crest is an event";
  start_bridge_timer(timing);
  const std::size_t started = first_with(tim1().cr1, tim_bits::kOn);
  const std::size_t written = first([](const Write& w) { return w.at == &tim1().rcr && w.value == 3u; });
  EXPECT_EQ(written, started + 1) << "four ends of a count between events, from the first one on";
}

TEST_F(Timer, MicrosecondsGoOnOverTheWrapOf32Bits) {
  Microseconds clock;
  std::uint64_t last = 0;
  for (std::uint64_t t = 0; t < 3ull << 32; t += 0x3000'0001) {
    tim2().cnt.hardware(static_cast<std::uint32_t>(t) - 1u);  // the look itself counts one
    const std::uint64_t now = clock.now();
    EXPECT_EQ(now, t);
    EXPECT_GE(now, last);
    last = now;
    tim2().cnt.hardware(static_cast<std::uint32_t>(t) - 1u);
    clock.keep();
  }
}

TEST_F(Timer, SamplesMayStayAwayForAtMostOneAndAHalfMilliseconds) {
  start_wwdg();
  EXPECT_EQ(wwdg().cfr.peek() >> 11 & 7u, 0u);
  EXPECT_LE(kWwdg_us, 1500u);
}

}  // namespace
}  // namespace rotorloop::g431
