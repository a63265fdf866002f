// A small edition of `scripts/stats identify`: six trials instead of three hundred, limits wide enough for six, narrow enough to fail
// with a wrong model. Seeds are the first six.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "test/stats/identify_ensemble.hpp"

namespace rotorloop::stats {
namespace {

std::vector<Trial> trials(TrialSettings s, std::uint64_t count) {
  std::vector<Trial> out;
  for (s.seed = 1; s.seed <= count; ++s.seed) out.push_back(run_trial(s));
  return out;
}

TEST(IdentifyStudy, SixTrialsFindTheTruthWithinTheirOwnStandardErrors) {
  const auto quantity = quantities(study_truth());
  const EnsembleResult r = summarise(quantity, trials({}, 6));
  EXPECT_EQ(r.not_converged, 0u);
  EXPECT_GT(r.pooled_within_2u, 0.87);  // of 108 numbers; 95.4 % expected
  EXPECT_GT(r.pooled_rms_z, 0.75);
  EXPECT_LT(r.pooled_rms_z, 1.25);
  for (std::size_t i = 0; i < quantity.size(); ++i) {
    EXPECT_LT(std::fabs(r.quantity[i].mean_z), 1.7) << quantity[i].name;  // 4 of its own standard deviations
    if (quantity[i].limit > 0.0) {
      EXPECT_LT(3 * r.quantity[i].mean_u, quantity[i].limit) << quantity[i].name << ": what these flights can determine at best";
      EXPECT_LT(r.quantity[i].rms_error, 2.0 * quantity[i].limit / 3.0) << quantity[i].name;
    }
  }
}

TEST(IdentifyStudy, NoiseFoundByTheFitIsThatOfTheFlightsWithin5Percent) {
  const auto all = trials({.estimate_noise = true}, 1);
  EXPECT_TRUE(all[0].converged);
  EXPECT_NEAR(all[0].q_a_m_s2_rtHz, 0.03, 0.0015);
  EXPECT_NEAR(all[0].q_alpha_rad_s2_rtHz, 0.3, 0.015);
  EXPECT_NEAR(all[0].pose_sigma_m, 0.002, 0.00005);
  EXPECT_NEAR(all[0].pose_sigma_rad, 0.002, 0.00005);
}

}  // namespace
}  // namespace rotorloop::stats
