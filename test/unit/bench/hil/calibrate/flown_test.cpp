// From truth logs to tunnel settings: what counts as flown, in which frame, and which logs are found.
#include "bench/hil/calibrate/flown.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::calibrate {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHeader =
    "# rotorloop truth log 1\n"
    "t[s],true_v_x[m/s],true_v_y[m/s],true_v_z[m/s],true_q_w[1],true_q_x[1],true_q_y[1],true_q_z[1],"
    "true_omega_1[rad/s],true_omega_2[rad/s],true_omega_3[rad/s],true_omega_4[rad/s]\n";

// 1 s on the stand with rotors turning up, then 1 s along +x of the world with the nose to +y.
std::string stand_then_flight() {
  std::string text = kHeader;
  for (int i = 0; i < 1000; ++i) text += fmt::format("{},0,0,0,1,0,0,0,{},0,0,0\n", 0.001 * i, i);
  for (int i = 1000; i < 2000; ++i) text += fmt::format("{},5,0,0,0.707107,0,0,0.707107,900,910,920,930\n", 0.001 * i);
  return text;
}

TEST(FlownStates, AreTakenFromLiftOffOnEveryPeriodInBodyAxes) {
  const test::TempFolder folder;
  const auto states = flown_states(folder.write("truth.csv", stand_then_flight()), 0.1);
  ASSERT_EQ(states.size(), 10u);
  for (const FlownState& s : states) {
    EXPECT_NEAR(s.v_B_m_s.x(), 0.0, 1e-5);
    EXPECT_NEAR(s.v_B_m_s.y(), -5.0, 1e-5);  // moving to its right
    EXPECT_EQ(s.omega_rad_s[3], 930.0);
  }
}

TEST(FlownStates, ARunThatNeverLeftItsStandIsRefused) {
  const test::TempFolder folder;
  const auto log = folder.write("truth.csv", std::string(kHeader) + "0,0,0,0,1,0,0,0,500,500,500,500\n");
  EXPECT_THAT(test::error_of([&] { flown_states(log, 0.1); }, ExitCode::data_quality), HasSubstr("never moves faster than 0.001 m/s"));
}

TEST(FlownStates, AFlightLogIsNotATruthLog) {
  const test::TempFolder folder;
  const auto log = folder.write("flight.csv", "# rotorloop flight log 1\nt[s],p_x[m]\n0,0\n");
  EXPECT_THAT(test::error_of([&] { flown_states(log, 0.1); }, ExitCode::data_quality), HasSubstr("true_v_x[m/s]"));
}

TEST(TruthLogs, AreFoundByVariantInOrderOfTheirPaths) {
  const test::TempFolder folder;
  for (const char* p : {"vertical/pd_ff/1", "vertical/pd_ff_drag/1", "horizontal/pd_ff/2", "horizontal/pd_ff/1"}) {
    folder.write(std::string(p) + "/truth.csv", kHeader);
    folder.write(std::string(p) + "/flight.csv", "");
  }
  EXPECT_EQ(truth_logs(folder.path(), "").size(), 4u);
  const auto found = truth_logs(folder.path(), "pd_ff");
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0], folder.path() / "horizontal/pd_ff/1/truth.csv");
  EXPECT_EQ(found[2], folder.path() / "vertical/pd_ff/1/truth.csv");
  EXPECT_THAT(test::error_of([&] { truth_logs(folder.path(), "pd_ff_thrust_drag"); }),
              HasSubstr("holds no truth.csv of variant pd_ff_thrust_drag"));
  EXPECT_THAT(test::error_of([&] { truth_logs(folder.path() / "nowhere", ""); }), HasSubstr("holds no truth.csv"));
}

}  // namespace
}  // namespace rotorloop::calibrate
