// Records of a large stand as it is used: cells that are not tared, motors without a propeller, a wind tunnel whose airspeed is not in the
// file, programs of two versions in one file. All made up here.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/random.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::stand {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string all_of(const std::vector<std::string>& lines) {
  std::string s;
  for (const auto& l : lines) s += l + "\n";
  return s;
}

StandEstimate estimate_of(const std::string& bytes) {
  const test::TempFolder folder;
  EstimateOptions o;
  o.draws = 100;
  return estimate_stand(read_stand_run(folder.write("log.csv", bytes), {}), o);
}

// A record of a stand in the layout of a Series 1780, 10 rows a second: speeds, 4 s each. `thrust_N`, `torque_N_m`, `current_A` of speed
// and time.
template <class Thrust, class Torque, class Current>
std::string record_of(const std::vector<double>& rpm, const Thrust& thrust_N, const Torque& torque_N_m, const Current& current_A) {
  std::string out = "Time (s),Torque (N·m),Thrust (N),Voltage (V),Current (A),Motor Optical Speed (RPM)\n";
  const RandomStream random(3, 5);
  std::uint64_t k = 0;
  double t = 0.0;
  for (const double n : rpm)
    for (int i = 0; i < 40; ++i, t += 0.1) {
      const double w = n * kRad_s_per_rpm;
      const double noise_N_m = 1e-3 * random.gaussian(k++), noise_N = 0.01 * random.gaussian(k++), noise_A = 0.005 * random.gaussian(k++);
      out += fmt::format("{:.2f},{:.6f},{:.5f},30.0,{:.4f},{:.1f}\n", t, torque_N_m(w, t) + noise_N_m, thrust_N(w, t) + noise_N,
                         current_A(w) + noise_A, n);
    }
  return out;
}
constexpr double kLargeCt = 2.1e-4, kLargeCq = 8e-6;  // of a propeller of 22 inches, as that series measures them
const std::vector<double> kLevels{0.0, 1000.0, 1400.0, 1800.0, 2200.0, 2600.0, 3000.0, 2600.0, 2200.0, 1800.0, 1400.0, 1000.0, 0.0};
double large_thrust(double w) { return kLargeCt * w * w; }
double large_torque(double w) { return kLargeCq * w * w; }
double motor_current(double w) { return 1.3 * kLargeCq * w * w * w / 30.0; }

TEST(UntaredStand, CellsOf4NAnd200mNmAndACurrentOfMinus1p2AAtRestLeaveTheCoefficientsAsTheyAre) {
  const StandEstimate e = estimate_of(record_of(
      kLevels, [](double w, double) { return large_thrust(w) - 4.0; }, [](double w, double) { return large_torque(w) + 0.2; },
      [](double w) { return motor_current(w) - 1.2; }));
  ASSERT_TRUE(e.thrust && e.torque) << all_of(e.faults);
  EXPECT_NEAR(e.thrust->value / kLargeCt, 1.0, 0.01);
  EXPECT_NEAR(e.torque->value / kLargeCq, 1.0, 0.03);
  EXPECT_THAT(all_of(e.remarks), HasSubstr("the current reads -1.2 A at rest"));
  EXPECT_THAT(all_of(e.faults), Not(HasSubstr("reads 0 in")));
}

TEST(StillAir, AMotorWithoutAPropellerIsNamedAndGivesNoCoefficient) {
  const StandEstimate e = estimate_of(record_of(
      kLevels, [](double, double t) { return 0.17 - 2e-4 * t; }, [](double w, double) { return 0.02 + 2e-7 * w * w; },
      [](double w) { return w > 0.0 ? 0.3 + 3e-3 * w : 0.0; }));
  EXPECT_FALSE(e.thrust || e.torque);
  EXPECT_THAT(all_of(e.faults), HasSubstr("no propeller shows"));
}

TEST(StillAir, AWindThatGrowsAtOneSpeedAndThrustBelowItsZeroAreNamedAndTheSameRunInStillAirIsEstimated) {
  const auto torque = [](double w, double) { return large_torque(w); };
  const auto current = [](double w) { return 1.4 * motor_current(w); };
  const std::vector<double> constant{0.0, 3000.0, 3000.0, 3010.0, 3000.0, 2990.0, 3000.0, 3005.0, 2600.0};
  const StandEstimate grows = estimate_of(record_of(
      constant, [](double w, double t) { return large_thrust(w) * (1.0 - 0.4 * t / 36.0); }, torque, current));
  EXPECT_FALSE(grows.thrust || grows.torque);
  EXPECT_THAT(all_of(grows.faults), HasSubstr("the air moves"));
  const StandEstimate steady = estimate_of(record_of(
      kLevels, [](double w, double) { return w > 0.0 ? large_thrust(w) - 0.03 * w - 3.0 : 0.0; }, torque, current));
  EXPECT_FALSE(steady.thrust || steady.torque);
  EXPECT_THAT(all_of(steady.faults), HasSubstr("the air moves"));
  const StandEstimate still = estimate_of(record_of(
      kLevels, [](double w, double) { return large_thrust(w); }, torque, current));
  EXPECT_TRUE(still.thrust && still.torque) << all_of(still.faults);
}

TEST(Credibility, AFigureOfMeritAboveOneForAnyDiameterIsRefusedWithoutADiameter) {
  const StandEstimate e = estimate_of(record_of(
      kLevels, [](double w, double) { return large_thrust(w); }, [](double w, double) { return 0.3 * large_torque(w); }, motor_current));
  EXPECT_FALSE(e.thrust || e.torque);
  EXPECT_THAT(all_of(e.faults), HasSubstr("figure of merit"));
}

TEST(ForeignStand, TwoVersionsOfAProgramInOneFileAndALogBegunAnewAreReadOnAndNoted) {
  const std::string record = record_of(
      kLevels, [](double w, double) { return large_thrust(w); }, [](double w, double) { return large_torque(w); }, motor_current);
  const auto with = [&](const std::string& names, const std::string& cells) {
    std::string out;
    for (std::size_t from = 0, to = record.find('\n'); to != std::string::npos; from = to + 1, to = record.find('\n', from))
      out += record.substr(from, to - from) + (from == 0 ? names : cells) + "\n";
    return out;
  };
  const StandEstimate shorter = estimate_of(with(",Target,P,I,D", "")), longer = estimate_of(with("", ",3500,0,0,0,0,0.1"));
  ASSERT_TRUE(shorter.thrust && longer.thrust) << all_of(shorter.faults) << all_of(longer.faults);
  EXPECT_NEAR(shorter.thrust->value / kLargeCt, 1.0, 0.01);
  EXPECT_NEAR(longer.thrust->value / kLargeCt, 1.0, 0.01);
  EXPECT_THAT(all_of(shorter.remarks), HasSubstr("520 of 520 rows have 6 cells for 10 names"));
  EXPECT_THAT(all_of(longer.remarks), HasSubstr("520 of 520 rows have more cells than the 6 names"));
  const StandEstimate twice = estimate_of(record + record);
  ASSERT_TRUE(twice.thrust) << all_of(twice.faults);
  EXPECT_NEAR(twice.thrust->value / kLargeCt, 1.0, 0.01);
  EXPECT_THAT(all_of(twice.remarks), HasSubstr("the row of names comes 1 more times, last in line 522"));
  EXPECT_THAT(all_of(twice.remarks), HasSubstr("time starts again 1 times"));
  std::string other = record;
  other.replace(other.find("Torque (N·m),Thrust (N)"), std::string("Torque (N·m),Thrust (N)").size(), "Thrust (N),Torque (N·m)");
  const test::TempFolder folder;
  EXPECT_THAT(test::error_of([&] { (void)read_stand_run(folder.write("log.csv", record + other), {}); }, ExitCode::data_quality),
              HasSubstr("is a second row of names, in which column 2 is \"Thrust (N)\""));
}

}  // namespace
}  // namespace rotorloop::stand
