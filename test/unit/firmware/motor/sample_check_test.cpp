// Which current samples are accepted: sums and jumps of three shunts, of two when the third window is too short.
#include "firmware/core/motor/sample_check.hpp"

#include <gtest/gtest.h>

namespace rotorloop::firmware {
namespace {

constexpr float kBus_V = 14.0f;
constexpr SampleCheckConfig kCheck{.change_A_V = 4.2f};  // 15 uH at 24 kHz

// 30 A along U: 30, -15, -15 A.
constexpr Stator kExpected_A{30.0f, 0.0f};

Sensed two_phases(float v_A, float w_A) {  // the low side of U was on too briefly
  Sensed s;
  s.usable = 2;
  s.blind = 0;
  s.phase_A = {-(v_A + w_A), v_A, w_A};
  s.current_A = clarke(s.phase_A);
  return s;
}

TEST(SampleCheck, WithTwoPhasesAJumpOfOneAloneIsReplacedByWhatWasExpected) {
  SampleCheckState state;
  Sensed s = two_phases(-15.5f, 14.0f);  // W: 29 A off, V: 0.5 A
  EXPECT_EQ(check_sample(kCheck, state, s, kExpected_A, kBus_V), Sample::replaced);
  EXPECT_NEAR(s.phase_A[2], -15.0f, 1e-4f);
  EXPECT_NEAR(s.current_A.a, 30.0f, 1e-4f);
}

TEST(SampleCheck, TheSecondInARowIsLost) {
  SampleCheckState state;
  Sensed first = two_phases(-15.5f, 14.0f), second = first;
  EXPECT_EQ(check_sample(kCheck, state, first, kExpected_A, kBus_V), Sample::replaced);
  EXPECT_EQ(check_sample(kCheck, state, second, kExpected_A, kBus_V), Sample::lost);
}

TEST(SampleCheck, ACurrentThatGrowsInBothPhasesIsAccepted) {
  SampleCheckState state;
  Sensed s = two_phases(-30.0f, -30.0f);  // along U, as a winding's short-circuit to U would drive it
  EXPECT_EQ(check_sample(kCheck, state, s, kExpected_A, kBus_V), Sample::good);
  EXPECT_NEAR(s.phase_A[0], 60.0f, 1e-4f);
}

TEST(SampleCheck, AStepThatTheCurrentLoopMakesIsAccepted) {
  SampleCheckState state;
  Sensed s = two_phases(-15.0f, -9.0f);  // 6 A of one phase alone
  EXPECT_EQ(check_sample(kCheck, state, s, kExpected_A, kBus_V), Sample::good);
  EXPECT_NEAR(s.phase_A[2], -9.0f, 1e-4f);
}

TEST(SampleCheck, WithThreePhasesTheSumSaysWhichOneIsWrong) {
  SampleCheckState state;
  Sensed s;
  s.phase_A = {30.0f, -15.0f, 45.0f};  // W at the rail
  s.residual_A = 60.0f;
  for (float& x : s.phase_A) x -= 20.0f;
  s.current_A = clarke(s.phase_A);
  EXPECT_EQ(check_sample(kCheck, state, s, kExpected_A, kBus_V), Sample::replaced);
  EXPECT_NEAR(s.phase_A[2], -15.0f, 1e-4f);
}

}  // namespace
}  // namespace rotorloop::firmware
