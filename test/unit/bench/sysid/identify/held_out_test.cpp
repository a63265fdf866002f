// Scores on flights that had no part in a fit, on flights of another simulator that obey the equations: parameters that are right predict
// better than wrong ones at every horizon at which they can, their one-step errors are as large as they say, and what no flight is long
// enough for is told.
#include "bench/sysid/identify/held_out.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "host/base/error.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::identify {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

estimate::ModelValues right() { return estimate::model_values(model_true::vehicle_of({})); }
// Thrust, torque and inertia 20 % off.
estimate::ModelValues wrong() {
  estimate::ModelValues v = right();
  for (const int p : {estimate::kK1, estimate::kCq, estimate::kIxx, estimate::kIyy, estimate::kIzz}) v[p] *= 1.2;
  return v;
}

// As a fit ends that found these values and the noise that was flown.
Identification found(const estimate::ModelValues& values) {
  estimate::NoiseModel noise;  // poses: 2 mm and 2 mrad, as by default
  noise.force_m_s2_rtHz.setConstant(0.03);
  noise.angular_rad_s2_rtHz.setConstant(0.3);
  Identification r;
  r.fit.values = {values};
  r.fit.noise = {noise};
  r.start.file = values;
  return r;
}

FlightToFit flight(double duration_s, std::uint64_t seed = 77) {
  model_true::FlightSettings s;
  s.manoeuvre = model_true::Manoeuvre::rotation;
  s.seed = seed;
  s.duration_s = duration_s;
  return {model_true::fly({}, s).record, FlightRole::any, {}, {}};
}
const estimate::GridOptions kGrid{.rate_Hz = 200.0};

struct Both {
  HeldOutScores right_after_wrong, wrong_after_right;
};
const Both& scored() {
  static const Both both = [] {
    const std::vector<FlightToFit> f{flight(16.0)};
    const Identification good = found(right()), bad = found(wrong());
    return Both{score_models(f, bad, good, kGrid), score_models(f, good, bad, kGrid)};
  }();
  return both;
}

TEST(HeldOutHorizons, RunFromAHundredthToTwoSecondsForEachQuantity) {
  const auto& rows = scored().right_after_wrong.rows;
  ASSERT_EQ(rows.size(), 32u);
  constexpr double kHorizons_s[] = {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].horizon_s, kHorizons_s[i % 8], 1e-12);
    EXPECT_EQ(rows[i].quantity, i / 8);
  }
  EXPECT_TRUE(scored().right_after_wrong.remarks.empty());
}

TEST(HeldOutHorizons, ParametersThatAreRightPredictBetterThanOnesTwentyPercentOffWhereverTheyCan) {
  ASSERT_EQ(scored().right_after_wrong.rows.size(), 32u);
  ASSERT_EQ(scored().wrong_after_right.rows.size(), 32u);
  for (const HeldOutRow& r : scored().right_after_wrong.rows) {
    // Thrust acts on the velocity at once; what torque does to rates needs a tenth of a second to rise above the noise of the states.
    const bool tells = r.quantity == score::kPredictedPosition || r.quantity == score::kPredictedVelocity || r.horizon_s > 0.09;
    if (tells) {
      EXPECT_LT(r.ratio.high, 1.0) << score::kPredictedUnits[r.quantity] << " after " << r.horizon_s << " s";
    }
    EXPECT_LT(r.ratio.low, 1.01) << score::kPredictedUnits[r.quantity] << " after " << r.horizon_s << " s";
  }
  for (const HeldOutRow& r : scored().wrong_after_right.rows) {
    EXPECT_GT(r.ratio.high, 0.99) << score::kPredictedUnits[r.quantity] << " after " << r.horizon_s << " s";
  }
}

// The states are smoothed along the second model; at a hundredth of a second that could have decided.
TEST(HeldOutHorizons, ModelsErrTheSameWhicheverOfThemTheStatesWereSmoothedAlong) {
  const auto &a = scored().right_after_wrong.rows, &b = scored().wrong_after_right.rows;
  ASSERT_EQ(a.size(), 32u);
  ASSERT_EQ(b.size(), 32u);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(a[i].after / b[i].before, 1.0, 0.03) << score::kPredictedUnits[a[i].quantity] << " after " << a[i].horizon_s << " s";
    EXPECT_NEAR(a[i].before / b[i].after, 1.0, 0.03) << score::kPredictedUnits[a[i].quantity] << " after " << a[i].horizon_s << " s";
  }
}

TEST(HeldOutHorizons, TheErrorOfTheRightModelIsItsFloorAtShortHorizonsToo) {
  ASSERT_EQ(scored().right_after_wrong.rows.size(), 32u);
  for (const HeldOutRow& r : scored().right_after_wrong.rows) {
    if (r.horizon_s > 0.15) continue;  // longer ones: noise_floor_test
    EXPECT_NEAR(r.after / r.floor, 1.0, 0.25) << score::kPredictedUnits[r.quantity] << " after " << r.horizon_s << " s";
  }
}

TEST(HeldOutOneStep, TheModelThatMadeTheFlightErrsAsMuchAsItExpects) {
  const score::OneStepComparison& s = scored().right_after_wrong.one_step;
  EXPECT_GT(s.poses, 3000u);
  EXPECT_NEAR(s.step_s, 0.005, 1e-12);
  EXPECT_NEAR(s.size_after, 1.0, 0.03);
  ASSERT_EQ(s.rows.size(), 2u);
  for (const auto& r : s.rows) EXPECT_NEAR(r.after / r.expected, 1.0, 0.05) << score::kPredictedUnits[r.quantity];
}

TEST(HeldOutOneStep, ParametersTwentyPercentOffAreLessLikelyAndErrMoreThanTheyExpect) {
  const score::OneStepComparison &up = scored().right_after_wrong.one_step, &down = scored().wrong_after_right.one_step;
  EXPECT_GT(up.size_before, 1.3);
  EXPECT_GT(up.gain.low, 0.0);
  EXPECT_LT(down.gain.high, 0.0);
  EXPECT_NEAR(up.gain.value, up.log_density_after - up.log_density_before, 1e-9);
  for (const auto& r : up.rows) EXPECT_LT(r.ratio.high, 1.0) << score::kPredictedUnits[r.quantity];
  for (const auto& r : down.rows) EXPECT_GT(r.ratio.low, 1.0) << score::kPredictedUnits[r.quantity];
}

// 2 mm and 2 mrad a pose read, and a model that knows the state to nothing: the density of a pose cannot be higher than that of its noise.
TEST(HeldOutOneStep, TheLogDensityIsInMetresAndRadians) {
  const double of_noise = -6.0 * std::log(0.002) - 3.0 * std::log(2.0 * M_PI) - 3.0;
  EXPECT_LT(scored().right_after_wrong.one_step.log_density_after, of_noise);
  EXPECT_GT(scored().right_after_wrong.one_step.log_density_after, of_noise - 3.0);
}

TEST(HeldOutOneStep, TheVehicleFilesModelGetsTheNoiseFiguresThatItNeedsOnTheFittedFlights) {
  const std::vector<FlightToFit> kept{flight(5.0)};
  Identification r = found(right());
  r.start.file = wrong();
  r.flights.push_back(make_grid(flight(5.0, 5).record, kGrid));
  IdentifyOptions o;
  o.grid = kGrid;
  const score::OneStepComparison same = score_held_out(kept, r, o).one_step;
  o.fit.noise.rounds = 10;
  const score::OneStepComparison own = score_held_out(kept, r, o).one_step;
  EXPECT_GT(same.size_before, 1.3);
  EXPECT_LT(own.size_before, 1.2);
  EXPECT_GT(own.log_density_before, same.log_density_before);
  EXPECT_LT(own.log_density_before, own.log_density_after);
  EXPECT_DOUBLE_EQ(own.size_after, same.size_after);
}

TEST(HeldOutHorizons, AFlightTooShortForAHorizonSaysSoAndIsScoredAtTheOthers) {
  const Identification good = found(right()), bad = found(wrong());
  const HeldOutScores s = score_models({flight(1.6)}, bad, good, kGrid);
  EXPECT_NEAR(s.rows.back().horizon_s, 1.0, 1e-12);
  EXPECT_THAT(s.remarks, Contains(HasSubstr("no held-out flight has 2 s in one piece")));
  EXPECT_THAT(held_out_table(s), HasSubstr("no held-out flight has 2 s in one piece"));
}

TEST(HeldOutHorizons, OneOfSeveralFlightsThatIsTooShortIsLeftOutByName) {
  const Identification good = found(right()), bad = found(wrong());
  FlightToFit brief = flight(1.6, 3);
  brief.record.name = "brief";
  const HeldOutScores s = score_models({flight(4.0), brief}, bad, good, kGrid);
  EXPECT_NEAR(s.rows.back().horizon_s, 2.0, 1e-12);
  EXPECT_THAT(s.remarks, Contains(HasSubstr("brief: not predicted, it has no 2 s in one piece")));
  EXPECT_EQ(s.flights.size(), 1u);
}

TEST(HeldOutHorizons, BelowAStepOfTheStatesThereIsNoPredictionAndThatIsSaid) {
  const Identification good = found(right()), bad = found(wrong());
  const HeldOutScores s = score_models({flight(4.0)}, bad, good, {.rate_Hz = 25.0});
  EXPECT_NEAR(s.rows.front().horizon_s, 0.04, 1e-12);  // stands for 0.05 s
  EXPECT_THAT(s.remarks, Contains(HasSubstr("0.01, 0.02 s: not predicted, a step of the states is 0.04 s long")));
}

TEST(HeldOutFloors, AboveOneAndAHalfTimesTheErrorAreSaidWithQuantityAndHorizonAndOthersAreNot) {
  const auto row = [](score::PredictedQuantity quantity, double horizon_s, double floor) {
    return HeldOutRow{horizon_s, quantity, 1.0, 1.0, {1.0, 0.9, 1.1}, floor, {}};
  };
  EXPECT_EQ(floors_above_errors({row(score::kPredictedPosition, 0.1, 1.49), row(score::kPredictedAttitude, 0.5, 0.2)}), "");
  EXPECT_THAT(floors_above_errors({row(score::kPredictedPosition, 0.1, 1.49), row(score::kPredictedAttitude, 0.5, 2.0),
                                   row(score::kPredictedAttitude, 1.0, 1.6)}),
              testing::AllOf(HasSubstr("attitude after 0.5, 1 s (up to 2.0 times)"), testing::Not(HasSubstr("position"))));
}

TEST(HeldOutPage, ColoursOnlyDifferencesThatAreWorthOne) {
  HeldOutScores s;
  s.flights = {"kept"};
  const auto row = [](double low, double value, double high) {
    return HeldOutRow{0.1, score::kPredictedVelocity, 1.0, value, {value, low, high}, 0.5, {}};
  };
  s.rows = {row(1.0, 1.004, 1.01)};
  EXPECT_THAT(held_out_html(s), testing::Not(HasSubstr("class=\"fail\"")));
  s.rows = {row(1.02, 1.1, 1.2)};
  EXPECT_THAT(held_out_html(s), HasSubstr("class=\"fail\""));
  s.rows = {row(0.8, 0.9, 0.97)};
  EXPECT_THAT(held_out_html(s), HasSubstr("class=\"pass\""));
}

TEST(HeldOutJson, HoldsWhatTheTableHolds) {
  const HeldOutScores& s = scored().right_after_wrong;
  const nlohmann::ordered_json j = held_out_json(s);
  ASSERT_EQ(j.at("rows").size(), s.rows.size());
  EXPECT_EQ(j.at("rows").at(0).at("horizon_s"), s.rows[0].horizon_s);
  EXPECT_EQ(j.at("rows").at(9).at("quantity"), "velocity");
  EXPECT_EQ(j.at("rows").at(9).at("ratio"), s.rows[9].ratio.value);
  EXPECT_EQ(j.at("rows").at(9).at("floor"), s.rows[9].floor);
  EXPECT_EQ(j.at("one_step").at("size").at("after"), s.one_step.size_after);
  EXPECT_EQ(j.at("one_step").at("log_likelihood").at("low"), s.one_step.gain.low);
  EXPECT_EQ(j.at("one_step").at("rows").at(1).at("quantity"), "attitude");
}

}  // namespace
}  // namespace rotorloop::identify
