// The host's end of the fast channel by itself.
#include "host/node/esc_group.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rotorloop::host {
namespace {

namespace fast = protocols::fast;

CanFrame answer(std::uint8_t esc_index, std::uint8_t sequence) {
  fast::Feedback f;
  f.esc_index = esc_index;
  f.sequence = sequence;
  f.set_speed_rad_s(500.0f);
  return encode(f);
}

TEST(EscGroup, SequenceRunsAndNaNIsNoOrder) {
  EscGroup g(2);
  for (int i = 1; i < 40; ++i) {
    const auto s =
        fast::decode_setpoint(g.encode(fast::SetpointMode::current, {1.0f, 2.0f, std::numeric_limits<float>::quiet_NaN(), 4.0f}, i * 1000));
    ASSERT_TRUE(s);
    EXPECT_EQ(s->sequence, i % 16);
    EXPECT_EQ(s->group, 2);
    EXPECT_EQ(s->raw, (std::array<std::int16_t, 4>{100, 200, fast::kNoOrder, 400}));
  }
}

TEST(EscGroup, RoundTripIsFromHandingOverToArrivalOfThatSequence) {
  EscGroup g(0);
  EXPECT_EQ(g.esc(1).age_us(5), std::numeric_limits<std::int64_t>::max());
  g.encode(fast::SetpointMode::rpm, {}, 10'000);
  g.encode(fast::SetpointMode::rpm, {}, 11'000);
  EXPECT_TRUE(g.on_frame(answer(1, 1), 11'700));  // to the first, late
  EXPECT_EQ(g.esc(1).round_trip_us, 1'700);
  EXPECT_TRUE(g.on_frame(answer(1, 2), 11'900));
  EXPECT_EQ(g.esc(1).round_trip_us, 900);
  EXPECT_EQ(g.esc(1).worst_round_trip_us, 1'700);
  EXPECT_EQ(g.esc(1).age_us(12'000), 100);
}

TEST(EscGroup, OtherGroupsAreNotItsBusiness) {
  EscGroup g(1);
  g.encode(fast::SetpointMode::rpm, {}, 0);
  EXPECT_FALSE(g.on_frame(answer(3, 1), 100));
  EXPECT_TRUE(g.on_frame(answer(4, 1), 100));
  EXPECT_TRUE(g.esc(0).heard);
  EXPECT_FALSE(g.on_frame(CanFrame{}, 100));
}

TEST(EscGroup, MissingAnswersAreCountedByTheDividerInUse) {
  for (const int divider : {1, 2, 4}) {
    EscGroup g(0, divider);
    for (int i = 1; i <= 64; ++i) {
      g.encode(fast::SetpointMode::rpm, {}, i * 1000);
      if (i % divider == 0 && i != 3 * divider && i != 7 * divider) g.on_frame(answer(0, g.sequence()), i * 1000 + 400);
    }
    EXPECT_EQ(g.esc(0).lost, 2u) << divider;
  }
}

TEST(EscGroup, AnswerToNothingSentLatelyIsUnexpected) {
  EscGroup g(0);
  g.on_frame(answer(0, 5), 100);
  EXPECT_EQ(g.esc(0).unexpected, 1u);
  EXPECT_EQ(g.esc(0).round_trip_us, -1);
  g.encode(fast::SetpointMode::rpm, {}, 1000);
  g.on_frame(answer(0, 1), 1000 + 60'000);
  EXPECT_EQ(g.esc(0).unexpected, 2u);
}

}  // namespace
}  // namespace rotorloop::host
