// Which order the motor follows. Each protection is shown with the damage that its absence does: a node is built without the rule.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/unit/firmware/node/esc_rig.hpp"

namespace rotorloop::firmware {
namespace {

namespace fast = protocols::fast;

constexpr NodeRules kNoCommandTimeout{.command_timeout = false};
constexpr NodeRules kNoFastTimeout{.fast_timeout = false};
constexpr NodeRules kAnyTrafficFeeds{.only_active_setpoint_feeds = false};
constexpr NodeRules kAnySequence{.refuse_old_sequence = false};
constexpr NodeRules kDisarmDoesNotLatch{.disarm_latches = false};

// ---- arming

TEST(Arming, NothingSpinsTheMotorBeforeArmingStatus255) {
  EscRig rig;
  rig.raw({0, 0, 4000, 0});
  EXPECT_FALSE(rig.spins());
  rig.rpm({0, 0, 8000, 0});
  EXPECT_FALSE(rig.spins());
  rig.fast(800.0f);
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(rig.node.command_counters().not_armed, 3u);
}

TEST(Arming, ArmingAloneDoesNotSpinAndOrdersFromBeforeAreForgotten) {
  EscRig rig;
  rig.raw({0, 0, 4000, 0});
  rig.arm();
  EXPECT_FALSE(rig.spins()) << "an order given while disarmed must not start the motor at arming";
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins());
}

TEST(Arming, WithoutRequireArmingACommandSuffices) {
  Parameters p = valid_parameters();
  p.require_arming = false;
  EscRig rig(p);
  EXPECT_FALSE(rig.spins());
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins());
}

bool spins_after_disarm_and_next_command(const NodeRules& rules) {
  EscRig rig(valid_parameters(), {}, rules);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins());
  rig.disarm();
  EXPECT_FALSE(rig.spins()) << "at once, not at the time-out";
  rig.advance_us(2500);
  rig.raw({0, 0, 4000, 0});  // the stream of commands goes on
  return rig.spins();
}

TEST(Arming, DisarmingHoldsUntilTheNext255) {
  EXPECT_FALSE(spins_after_disarm_and_next_command({}));
  EXPECT_TRUE(spins_after_disarm_and_next_command(kDisarmDoesNotLatch)) << "the damage: the next command starts the motor again";
}

TEST(Arming, DisarmingStopsEvenWhereArmingIsNotRequired) {
  Parameters p = valid_parameters();
  p.require_arming = false;
  EscRig rig(p);
  rig.disarm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_FALSE(rig.spins());
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins());
}

TEST(Arming, ValuesBetween0And255Disarm) {
  for (int value = 1; value < 255; ++value) {
    EscRig rig;
    rig.arm();
    rig.raw({0, 0, 4000, 0});
    rig.send(protocols::ArmingStatus{.status = static_cast<std::uint8_t>(value)});
    EXPECT_FALSE(rig.spins()) << value;
    EXPECT_EQ(rig.node.command_counters().arming_unknown, 1u);
  }
}

// ---- time-out of DroneCAN commands

bool spins_a_second_after_the_last_command(const NodeRules& rules) {
  EscRig rig(valid_parameters(), {}, rules);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  rig.advance_us(1'000'000);
  return rig.spins();
}

TEST(CommandTimeout, MotorStopsWhenTheBusGoesSilent) {
  EXPECT_FALSE(spins_a_second_after_the_last_command({}));
  EXPECT_TRUE(spins_a_second_after_the_last_command(kNoCommandTimeout)) << "the damage: full order for ever";
}

// The time from the sending to the stamp, and from the stop to the bridge, is taken off (firmware/core/node/main_loop.hpp).
TEST(CommandTimeout, IsExactTo1MicrosecondOverItsRangeAndLeavesThreeQuartersOfAMillisecondForTheWay) {
  for (const std::uint16_t timeout_ms : {std::uint16_t{20}, std::uint16_t{250}, std::uint16_t{1000}}) {
    Parameters p = valid_parameters();
    p.command_timeout_ms = timeout_ms;
    EscRig rig(p);
    rig.arm();
    rig.rpm({0, 0, 8000, 0});
    const std::uint64_t last_us = rig.now_us + timeout_ms * 1000u - kOnItsWay_us;
    EXPECT_EQ(rig.node.setpoint(last_us).mode, Mode::speed);
    EXPECT_EQ(rig.node.setpoint(last_us + 1).mode, Mode::off) << "needs no poll to stop";
  }
}

static_assert(kOnItsWay_us >= 700 && kOnItsWay_us <= 800);

TEST(CommandTimeout, ExpiredCommandIsCountedOnceAndANewOneRunsAgain) {
  EscRig rig;
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  rig.advance_us(600'000);
  EXPECT_EQ(rig.node.command_counters().command_timeouts, 1u);
  rig.raw({0, 0, 4000, 0});
  EXPECT_TRUE(rig.spins()) << "still armed: a fresh order is enough";
}

// ---- only the active set-point feeds its own time-out

bool spins_on_other_traffic_alone(const NodeRules& rules) {
  EscRig rig(valid_parameters(), {}, rules);
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  for (int i = 0; i < 100; ++i) {
    rig.advance_us(10'000);
    rig.arm();  // keep-alives of the autopilot go on
    rig.send(protocols::NodeStatus{}, 30);
    rig.raw({4000, 4000});              // commands for other ESCs
    rig.fast(std::nanf(""));            // fast set-points without an order for this one
    rig.send(protocols::RawCommand{});  // empty array
  }
  return rig.spins();
}

TEST(CommandTimeout, NoOtherTrafficKeepsTheMotorSpinning) {
  EXPECT_FALSE(spins_on_other_traffic_alone({}));
  EXPECT_TRUE(spins_on_other_traffic_alone(kAnyTrafficFeeds)) << "the damage: keep-alives hold a dead command";
}

TEST(CommandTimeout, DroneCanCommandsDoNotFeedTheFastChannel) {
  EscRig rig;
  rig.arm();
  rig.fast(900.0f);
  for (int i = 0; i < 10; ++i) {
    rig.advance_us(5'000);
    rig.raw({0, 0, 1000, 0});
  }
  EXPECT_EQ(rig.setpoint().mode, Mode::duty) << "the fast order is 50 ms old";
  EXPECT_EQ(rig.node.command_counters().fast_timeouts, 1u);
}

TEST(CommandTimeout, FastSetpointsDoNotFeedTheDroneCanCommand) {
  EscRig rig;
  rig.arm();
  rig.raw({0, 0, 1000, 0});
  for (int i = 0; i < 300; ++i) {
    rig.advance_us(1'000);
    rig.fast(900.0f);
  }
  EXPECT_EQ(rig.setpoint().mode, Mode::speed);
  rig.advance_us(21'000);
  EXPECT_FALSE(rig.spins()) << "the DroneCAN command died long ago";
}

// ---- fast channel

bool spins_30_ms_after_the_last_fast_setpoint(const NodeRules& rules) {
  EscRig rig(valid_parameters(), {}, rules);
  rig.arm();
  rig.fast(900.0f);
  rig.advance_us(30'000);
  return rig.spins();
}

TEST(FastTimeout, MotorStops20msAfterTheLastSetpoint) {
  EXPECT_FALSE(spins_30_ms_after_the_last_fast_setpoint({}));
  EXPECT_TRUE(spins_30_ms_after_the_last_fast_setpoint(kNoFastTimeout)) << "the damage: a crashed host keeps the motor running";
  EscRig rig;
  rig.arm();
  rig.fast(900.0f);
  EXPECT_EQ(rig.node.setpoint(rig.now_us + 20'000).mode, Mode::speed);
  EXPECT_EQ(rig.node.setpoint(rig.now_us + 20'001).mode, Mode::off);
}

TEST(FastTimeout, FallsBackToAFreshDroneCanCommandThenStops) {
  EscRig rig;
  rig.arm();
  rig.raw({0, 0, 4096, 0});
  rig.fast(900.0f);
  EXPECT_EQ(rig.setpoint().mode, Mode::speed) << "the fast channel goes first";
  EXPECT_EQ(rig.node.setpoint(rig.now_us + 20'001).mode, Mode::duty) << "at that instant, without a poll in between";
  rig.advance_us(25'000);
  EXPECT_EQ(rig.setpoint().mode, Mode::duty);
  EXPECT_NEAR(rig.setpoint().value, 4096.0f / 8191.0f, 1e-6f);
  EXPECT_EQ(rig.node.command_counters().fallbacks, 1u);
  rig.advance_us(250'000);
  EXPECT_FALSE(rig.spins());
}

TEST(FastTimeout, NoOrderLetsTheTimeoutRun) {
  EscRig rig;
  rig.arm();
  rig.fast(900.0f);
  for (int i = 0; i < 30; ++i) {
    rig.advance_us(1'000);
    rig.fast(std::nanf(""));
  }
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(rig.node.command_counters().fast_no_order, 30u);
}

TEST(FastTimeout, SetpointsOfAnotherGroupAreNotForThisEsc) {
  EscRig rig;
  rig.arm();
  fast::Setpoint s{.mode = fast::SetpointMode::rpm, .group = 1, .sequence = 1};
  for (int i = 0; i < 4; ++i) s.set(i, 900.0f);
  rig.node.on_frame(encode(s), rig.now_us);
  rig.poll();
  EXPECT_FALSE(rig.spins());
  EXPECT_TRUE(rig.feedback().empty());
}

float speed_after_a_delayed_setpoint(const NodeRules& rules) {
  EscRig rig(valid_parameters(), {}, rules);
  rig.arm();
  rig.fast_with_sequence(5, 1500.0f);
  rig.advance_us(1'000);
  rig.fast_with_sequence(6, 500.0f);   // throttle down ...
  rig.fast_with_sequence(5, 1500.0f);  // ... and a gateway delivers the old frame again
  return rig.setpoint().value;
}

TEST(FastSequence, OlderSetpointDoesNotOverwriteANewerOne) {
  EXPECT_NEAR(speed_after_a_delayed_setpoint({}), 500.0f, 0.2f);
  EXPECT_NEAR(speed_after_a_delayed_setpoint(kAnySequence), 1500.0f, 0.2f) << "the damage: the motor speeds up again";
}

bool spins_on_a_repeated_frame(const NodeRules& rules) {
  EscRig rig(valid_parameters(), {}, rules);
  rig.arm();
  for (int i = 0; i < 50; ++i) {
    rig.fast_with_sequence(7, 900.0f);  // a stuck transmit buffer
    rig.advance_us(1'000);
  }
  return rig.spins() && rig.node.setpoint(rig.now_us).mode == Mode::speed && rig.node.command_counters().fast_timeouts == 0;
}

TEST(FastSequence, RepeatedFrameDoesNotFeedTheTimeout) {
  EXPECT_FALSE(spins_on_a_repeated_frame({}));
  EXPECT_TRUE(spins_on_a_repeated_frame(kAnySequence)) << "the damage: a hung host looks alive";
}

TEST(FastSequence, UpToSevenAheadAreAcceptedAndTheGapIsCounted) {
  for (std::uint8_t ahead = 0; ahead < 16; ++ahead) {
    EscRig rig;
    rig.arm();
    rig.fast_with_sequence(9, 900.0f);
    rig.fast_with_sequence(static_cast<std::uint8_t>(9 + ahead), 500.0f);
    const bool accepted = rig.setpoint().value < 600.0f;
    EXPECT_EQ(accepted, ahead >= 1 && ahead <= 7) << int{ahead};
    const CommandCounters& c = rig.node.command_counters();
    EXPECT_EQ(c.fast_lost, accepted ? ahead - 1u : 0u);
    EXPECT_EQ(c.fast_duplicate, ahead == 0 ? 1u : 0u);
    EXPECT_EQ(c.fast_old_sequence, ahead >= 8 ? 1u : 0u);
  }
}

TEST(FastSequence, AnyGapHealsBeforeTheTimeoutStopsTheMotor) {
  for (int gap = 0; gap < 10; ++gap) {  // set-points lost in a row at 1 kHz
    EscRig rig;
    rig.arm();
    rig.fast(900.0f);
    rig.sequence = static_cast<std::uint8_t>(rig.sequence + gap);
    rig.advance_us(1000u * static_cast<unsigned>(gap));
    for (int i = 0; i < 20; ++i) {
      rig.advance_us(1000);
      rig.fast(900.0f);
      EXPECT_TRUE(rig.spins()) << gap;
    }
    EXPECT_EQ(rig.node.command_counters().fast_timeouts, 0u) << gap;
  }
}

TEST(FastSequence, RestartedHostIsAcceptedAfterTheTimeoutWhateverItsSequence) {
  for (std::uint8_t first = 0; first < 16; ++first) {
    EscRig rig;
    rig.arm();
    rig.fast_with_sequence(9, 900.0f);
    rig.advance_us(21'000);
    rig.fast_with_sequence(first, 700.0f);
    EXPECT_NEAR(rig.setpoint().value, 700.0f, 0.2f) << int{first};
  }
}

// ---- values

TEST(Orders, RawCommandIsDutyOfFullScaleAndRpmCommandIsSpeed) {
  EscRig rig;
  rig.arm();
  rig.raw({0, 0, 8191, 0});
  EXPECT_EQ(rig.setpoint().mode, Mode::duty);
  EXPECT_EQ(rig.setpoint().value, 1.0f);
  rig.raw({0, 0, -8192, 0});
  EXPECT_EQ(rig.setpoint().value, -1.0f);
  rig.rpm({0, 0, -8950, 0});
  EXPECT_EQ(rig.setpoint().mode, Mode::speed);
  EXPECT_NEAR(rig.setpoint().value, -937.24f, 0.01f);
  rig.fast(12.0f, fast::SetpointMode::current);
  EXPECT_EQ(rig.setpoint().mode, Mode::current);
  EXPECT_NEAR(rig.setpoint().value, 12.0f, 0.005f);
}

TEST(Orders, EveryRawCommandAboveZeroAsksForAtLeastTheMinimumSpeedUnlessTheDeadBandHoldsIt) {
  EscRig rig;
  rig.arm();
  for (std::int16_t raw = 1; raw <= 300; ++raw) {
    rig.raw({0, 0, raw, 0});
    ASSERT_EQ(rig.setpoint().mode, Mode::speed) << raw;
    ASSERT_EQ(rig.setpoint().value, 105.0f) << raw;
  }
  rig.raw({0, 0, 600, 0});
  EXPECT_EQ(rig.setpoint().mode, Mode::duty) << "7 % of the voltage hold more than the minimum, 6 % of the greatest speed";
  rig.raw({0, 0, 0, 0});
  EXPECT_EQ(rig.setpoint().mode, Mode::off);
}

TEST(Orders, BeyondTheParametersAreClampedAndCounted) {
  EscRig rig;
  rig.arm();
  rig.rpm({0, 0, 131071, 0});
  EXPECT_EQ(rig.setpoint().value, 1780.0f);
  rig.rpm({0, 0, -131072, 0});
  EXPECT_EQ(rig.setpoint().value, -1780.0f);
  rig.rpm({0, 0, 10, 0});
  EXPECT_EQ(rig.setpoint().value, 105.0f) << "raised to the minimum speed";
  rig.rpm({0, 0, -10, 0});
  EXPECT_EQ(rig.setpoint().value, -105.0f);
  rig.fast(-160.0f, fast::SetpointMode::current);
  EXPECT_EQ(rig.setpoint().value, -40.0f);
  EXPECT_EQ(rig.node.command_counters().clamped, 5u);
}

TEST(Orders, ZeroSpeedAndZeroDutyStop) {
  EscRig rig;
  rig.arm();
  rig.rpm({0, 0, 8000, 0});
  rig.rpm({0, 0, 0, 0});
  EXPECT_FALSE(rig.spins());
  rig.raw({0, 0, 100, 0});
  EXPECT_TRUE(rig.spins());
  rig.raw({0, 0, 0, 0});
  EXPECT_FALSE(rig.spins());
  rig.raw({0, 0, 100, 0});
  rig.fast(0.0f);
  EXPECT_FALSE(rig.spins()) << "a fresh fast order to stop beats the DroneCAN command";
}

TEST(Orders, ArrayTooShortForThisEscIsNoOrder) {
  EscRig rig;
  rig.arm();
  rig.raw({4000, 4000});
  rig.rpm({8000, 8000});
  EXPECT_FALSE(rig.spins());
  EXPECT_EQ(rig.node.command_counters().not_addressed, 2u);
}

TEST(Orders, TimeThatRunsBackwardsStopsTheMotor) {
  EscRig rig;
  rig.arm();
  rig.raw({0, 0, 4000, 0});
  EXPECT_EQ(rig.node.setpoint(rig.now_us - 1).mode, Mode::off);
}

TEST(Orders, FastChannelOffByParameterIsOff) {
  Parameters p = valid_parameters();
  p.fast_channel = false;
  EscRig rig(p);
  rig.arm();
  rig.fast(900.0f);
  rig.poll();
  EXPECT_FALSE(rig.spins());
  EXPECT_TRUE(rig.feedback().empty());
  EXPECT_EQ(rig.node.counters().fast_disabled, 1u);
}

}  // namespace
}  // namespace rotorloop::firmware
