// The floor of prediction errors on flights of another simulator that obey the equations: a model that is right errs as much as its floor
// says, one that is wrong errs more, and the share of the gap that is closed comes out between them.
#include "bench/sysid/score/noise_floor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/estimate/flight_motion.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::score {
namespace {

constexpr std::size_t kSecond = 100;  // steps

estimate::NoiseModel true_noise() {
  estimate::NoiseModel n;
  n.force_m_s2_rtHz.setConstant(0.03);
  n.angular_rad_s2_rtHz.setConstant(0.3);
  return n;  // poses: 2 mm and 2 mrad, as by default
}

struct Scored {
  std::vector<PredictionErrors> right, wrong, floor;
};
const Scored& scored() {
  static const Scored all = [] {
    Scored out;
    const estimate::ModelValues right = estimate::model_values(model_true::vehicle_of({}));
    estimate::ModelValues wrong = right;
    wrong[estimate::kK1] *= 1.06;
    wrong[estimate::kIxx] *= 1.5;
    wrong[estimate::kIyy] *= 1.5;
    for (const auto m : {model_true::Manoeuvre::horizontal, model_true::Manoeuvre::rotation}) {
      model_true::FlightSettings s;
      s.manoeuvre = m;
      s.seed = 77;
      const estimate::GridFlight g = estimate::make_grid(model_true::fly({}, s).record, {.rate_Hz = 100.0, .longest_substep_s = 1e-2});
      const StateTrack track = fitted_track(g, estimate::states_by_measurements(g, right, true_noise()), right);
      const auto starts = prediction_starts(track, kSecond, 20);
      out.right.push_back(predict(track, whole_model(right, g.substeps), starts, kSecond));
      out.wrong.push_back(predict(track, whole_model(wrong, g.substeps), starts, kSecond));
      out.floor.push_back(noise_floor(g, track, right, true_noise(), true_noise(), starts, kSecond, 1));
    }
    return out;
  }();
  return all;
}

TEST(NoiseFloor, IsWhatAModelThatIsRightErrsFromATenthOfASecondToOneSecond) {
  for (std::size_t q = 0; q < kPredictedQuantities; ++q) {
    for (const std::size_t steps : {kSecond / 10, kSecond / 2, kSecond}) {
      const double ratio = summary(scored().right).mean[q][steps - 1] / summary(scored().floor).mean[q][steps - 1];
      EXPECT_NEAR(ratio, 1.0, 0.15) << kPredictedUnits[q] << ", " << steps << " steps";
    }
  }
}

TEST(NoiseFloor, IsExceededByAModelThatIsWrongAndTheRightOneClosesTheWholeGap) {
  const Scored& s = scored();
  for (const PredictedQuantity q : {kPredictedVelocity, kPredictedAttitude}) {
    EXPECT_GT(summary(s.wrong).mean[q][kSecond / 2 - 1], 1.3 * summary(s.floor).mean[q][kSecond / 2 - 1]);
    const ErrorRatio closed = share_closed(s.wrong, s.right, s.floor, q, kSecond / 2, kSecond / 2);
    EXPECT_NEAR(closed.value, 1.0, 0.25);
    EXPECT_LT(closed.low, closed.value);
    EXPECT_GT(closed.high, closed.value);
  }
}

TEST(NoiseFloor, RepeatsForASeedAndChangesWithIt) {
  model_true::FlightSettings s;
  s.duration_s = 3.0;
  const estimate::GridFlight g = estimate::make_grid(model_true::fly({}, s).record, {.rate_Hz = 100.0});
  const estimate::ModelValues right = estimate::model_values(model_true::vehicle_of({}));
  const StateTrack track = fitted_track(g, estimate::states_by_measurements(g, right, true_noise()), right);
  const auto starts = prediction_starts(track, 20, 50);
  const auto of = [&](std::uint64_t seed) { return noise_floor(g, track, right, true_noise(), true_noise(), starts, 20, seed).error[0]; };
  EXPECT_EQ(of(3), of(3));
  EXPECT_NE(of(3), of(4));
}

// Errors that are the same at every start.
std::vector<PredictionErrors> constant(double error) {
  std::vector<PredictionErrors> out{{"made up", 0.01, 1, {}, {}}};
  for (std::size_t k = 0; k < 1000; ++k) {
    out[0].starts.push_back(k);
    for (auto& e : out[0].error) e.push_back(error);
  }
  return out;
}

TEST(ShareClosed, OfAGapFromThreeDownToAFloorOfOneTwoThirdsAreClosedByAnErrorOfFiveThirds) {
  const ErrorRatio r = share_closed(constant(3.0), constant(5.0 / 3.0), constant(1.0), kPredictedPosition, 1, 1);
  EXPECT_NEAR(r.value, 2.0 / 3.0, 1e-9);
  EXPECT_NEAR(r.low, 2.0 / 3.0, 1e-9);
  EXPECT_NEAR(r.high, 2.0 / 3.0, 1e-9);
  EXPECT_LT(share_closed(constant(3.0), constant(4.0), constant(1.0), kPredictedPosition, 1, 1).value, 0.0) << "worse than before";
}

TEST(ShareClosed, IsNotANumberWhereTheErrorBeforeStoodAtTheFloor) {
  EXPECT_TRUE(std::isnan(share_closed(constant(1.01), constant(1.0), constant(1.0), kPredictedPosition, 1, 1).value));
  EXPECT_TRUE(std::isnan(share_closed(constant(1.0), constant(1.0), constant(1.2), kPredictedPosition, 1, 1).value));
}

}  // namespace
}  // namespace rotorloop::score
