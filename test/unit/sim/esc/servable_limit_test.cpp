// Which phase current limit an ESC can serve: of each power stage by its own board, and of no other.
#include "sim/esc/servable_limit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/motor/limits.hpp"
#include "firmware/core/motor/timing.hpp"
#include "host/base/error.hpp"

namespace rotorloop::sim {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kInductance_H = 20e-6, kBus_V = 8.4;

// What a core of `Board` with a limit of `limit_A` may be asked for is all of what is asked.
template <class Board>
bool serves(double limit_A) {
  firmware::Parameters p;
  p.inductance_H = static_cast<float>(kInductance_H);
  firmware::LimitConfig limits;
  firmware::configure_range<Board>(p, firmware::sample_s<Board>(), limits);
  return firmware::kAskedShare * static_cast<float>(limit_A) <= firmware::range_limit_A(limits, static_cast<float>(kBus_V));
}

template <class Board>
void expect_largest(std::string_view stage) {
  const double limit_A = servable_limit(*find_board_stage(stage), kInductance_H, kBus_V).limit_A;
  EXPECT_TRUE(serves<Board>(limit_A)) << stage;
  EXPECT_FALSE(serves<Board>(limit_A + 0.11)) << stage;
}

TEST(ServableLimit, IsTheLargestThatTheCoreOfEachBoardServesInFullToATenthOfAnAmpere) {
  expect_largest<firmware::FakeBoard>("b_g431b_esc1");
  expect_largest<firmware::SmallFakeBoard>("small_2s_15a");
  expect_largest<firmware::HighVoltageFakeBoard>("high_voltage_14s_120a");
}

TEST(ServableLimit, IsKnownOfEveryPowerStage) {
  for (const BoardStage& stage : board_stages()) EXPECT_GT(servable_limit(stage, kInductance_H, kBus_V).limit_A, 0.0) << stage.name;
}

TEST(ServableLimit, StageThatNoFirmwareDrivesIsRefusedWithItsNameAndThoseKnown) {
  BoardStage stage = board_stages().front();
  stage.name = "somebodys_80a";
  try {
    (void)servable_limit(stage, kInductance_H, kBus_V);
    FAIL() << "taken for another board";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("\"somebodys_80a\""), HasSubstr("b_g431b_esc1, small_2s_15a, high_voltage_14s_120a")));
  }
}

}  // namespace
}  // namespace rotorloop::sim
