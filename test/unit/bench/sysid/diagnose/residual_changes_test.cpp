// Changes in time and in scatter, on residuals of flights whose states are known: found with moment and size, and not found in noise.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/sysid/diagnose/residuals/steps_in_time.hpp"
#include "bench/sysid/diagnose/residuals/variance_effects.hpp"
#include "host/base/statistics.hpp"
#include "test/unit/bench/sysid/diagnose/made_up_series.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace testing;

StepOptions quick_steps() {
  StepOptions o;
  o.resamples = 199;
  return o;
}

// Adds a wrench to the flight's own residuals from a moment of one flight on.
void add_wrench(ResidualSeries& r, std::size_t flight, double from_s, const Eigen::Matrix<double, 6, 1>& w) {
  for (std::size_t i = flight * kPerFlight + static_cast<std::size_t>(from_s / kStep_s); i < (flight + 1) * kPerFlight; ++i)
    r.whitened.steps[i].col(0) += (r.state[i].whitened_by_wrench * w).cast<float>();
}

TEST(StepInTime, Of15percentOfOneRotorsThrustAt12sOfTheThirdFlightIsFoundWithMomentAndSize) {
  ResidualSeries r = known_states();
  const auto kinds = step_kinds(r.state);
  std::size_t rotor_2 = 0;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (kinds[k].parameter == "epsilon of rotor 2") rotor_2 = k;
  }
  add_wrench(r, 2, 12.0, -0.15 * kinds[rotor_2].wrench[0]);
  const StepsResult s = steps_in_time(r, kinds, quick_steps());
  ASSERT_EQ(s.events.size(), 1u);
  const TimeStep& first = s.steps[s.events[0].front()];
  EXPECT_EQ(first.effect, "weak_rotor");
  EXPECT_EQ(first.parameter, "epsilon of rotor 2");
  EXPECT_EQ(first.flight, 2u);
  EXPECT_NEAR(first.at_s, 12.0, 0.5);
  EXPECT_NEAR(first.size, -0.15, 3.0 * first.u + 0.02);
  EXPECT_LT(first.p_holm, 1e-4);
}

TEST(StepInTime, ThatMakesLessOfTheRmsThanMattersIsNoEventHoweverCertain) {
  ResidualSeries r = known_states();
  const auto kinds = step_kinds(r.state);
  Eigen::Matrix<double, 6, 1> lift = Eigen::Matrix<double, 6, 1>::Zero();
  lift[2] = 0.3;
  add_wrench(r, 1, 10.0, lift);
  StepOptions o = quick_steps();
  ASSERT_FALSE(steps_in_time(r, kinds, o).events.empty());
  const double rms = 0.5 * lift[2];  // of a step in the middle of a flight about its mean
  o.matters = {1.2 * rms, 1.2 * rms, 1.2 * rms, 1.0, 1.0, 1.0};
  const StepsResult small = steps_in_time(r, kinds, o);
  EXPECT_TRUE(small.events.empty());
  ASSERT_EQ(small.too_small.size(), 1u) << "it is kept";
  EXPECT_FALSE(small.steps[small.too_small[0].front()].matters);
  o.matters = {1.0, 1.0, 0.5 * rms, 1.0, 1.0, 1.0};
  EXPECT_EQ(steps_in_time(r, kinds, o).events.size(), 1u);
}

std::string reported(const StepsResult& s) {
  std::string out;
  for (const auto& event : s.events) {
    const TimeStep& t = s.steps[event.front()];
    out += t.effect + " " + t.parameter + " in flight " + std::to_string(t.flight) + " at " + std::to_string(t.at_s) + " s, chi2 " +
           std::to_string(t.chi2) + " limit " + std::to_string(t.limit) + " p " + std::to_string(t.p) + "\n";
  }
  return out;
}

TEST(StepInTime, IsNotFoundInWhiteNoiseNorInAConstantNorInAForceThatWanders) {
  ResidualSeries r = known_states();
  const auto kinds = step_kinds(r.state);
  EXPECT_EQ(reported(steps_in_time(r, kinds, quick_steps())), "");
  for (std::size_t f = 0; f < kFlights; ++f) add_wrench(r, f, 0.0, Eigen::Matrix<double, 6, 1>::Constant(0.02));
  EXPECT_EQ(reported(steps_in_time(r, kinds, quick_steps())), "") << "a constant";
  const std::vector<double> gust = wandering(300, 0.7);
  for (std::size_t i = 0; i < kAll; ++i)
    r.whitened.steps[i].col(0) += (0.3 * gust[i] * r.state[i].whitened_by_wrench.rowwise().sum()).cast<float>();
  EXPECT_EQ(reported(steps_in_time(r, kinds, quick_steps())), "") << "gusts";
}

const VarianceEffect& effect(const VarianceResult& v, const std::string& id) {
  for (const VarianceEffect& e : v.effects) {
    if (e.id == id) return e;
  }
  throw std::out_of_range(id);
}

TEST(VarianceEffects, AreTheRowsOfTheCatalogueThatChangeTheScatterEachOnce) {
  std::vector<std::string> tested, rows;
  for (const VarianceKind& k : variance_kinds(known_states())) {
    if (!k.id.empty()) tested.push_back(k.id);
  }
  for (const host::CatalogueEffect& e : host::builtin_effect_catalogue().effects) {
    if (e.kind == host::EffectKind::variance) rows.push_back(e.id);
  }
  EXPECT_THAT(tested, ::testing::UnorderedElementsAreArray(rows));
}

TEST(VarianceEffects, FindNothingInNoiseOfTheFittedSizeNorInMoreNoiseEverywhere) {
  ResidualSeries r = known_states();
  const auto kinds = variance_kinds(r);
  for (const VarianceEffect& e : variance_effects(r, kinds).effects) EXPECT_FALSE(e.found) << e.what << ", p " << e.p_holm;
  for (std::size_t i = 0; i < kAll; ++i) {
    r.whitened.steps[i].col(0) *= 1.2f;
    r.whitened.poses[i].col(0) *= 1.2f;
  }
  for (const VarianceEffect& e : variance_effects(r, kinds).effects) EXPECT_FALSE(e.found) << e.what << ": noise 1.2 times as large";
}

TEST(VarianceEffects, FindPoseStampsThatScatterBy1ms) {
  ResidualSeries r = known_states();
  const std::vector<double> n = white(310, 1e-3);
  for (std::size_t i = 0; i < kAll; ++i) r.whitened.poses[i].col(0) += (n[i] * r.whitened.pose_by_stamp[i]).cast<float>();
  const VarianceResult v = variance_effects(r, variance_kinds(r));
  EXPECT_EQ(v.effects.front().id, "pose_stamp_jitter");
  EXPECT_TRUE(v.effects.front().found);
  EXPECT_NEAR(v.effects.front().size, 1e-3, 3e-4);
  EXPECT_FALSE(effect(v, "vortex_ring_fluctuation").found);
  EXPECT_FALSE(v.effects[1].found) << v.effects[1].what;
}

TEST(VarianceEffects, FindThrustThatWandersInVerticalDescentAlone) {
  ResidualSeries r = known_states();
  const auto kinds = variance_kinds(r);
  for (const VarianceKind& k : kinds) {
    if (k.id != "vortex_ring_fluctuation") continue;
    for (std::size_t rotor = 0; rotor < 4; ++rotor) {
      const std::vector<double> n = wandering(320 + rotor, 0.1);
      for (std::size_t i = 0; i < kAll; ++i) r.whitened.steps[i].col(0) += static_cast<float>(0.1 * n[i]) * k.directions[i][rotor];
    }
  }
  const VarianceResult v = variance_effects(r, kinds);
  EXPECT_EQ(v.effects.front().id, "vortex_ring_fluctuation");
  EXPECT_TRUE(v.effects.front().found);
  EXPECT_NEAR(v.effects.front().size, 0.1, 0.04);
}

TEST(VarianceEffects, FindGustsOf1mSThatKeepTheirDirectionForASecond) {
  ResidualSeries r = known_states();
  const std::vector<double> x = wandering(330, 1.0), y = wandering(331, 1.0);
  for (std::size_t i = 0; i < kAll; ++i)
    r.whitened.steps[i].col(0) += (r.state[i].whitened_by_wrench * r.state[i].wrench_by_wind * Eigen::Vector2d(x[i], y[i])).cast<float>();
  const VarianceResult v = variance_effects(r, variance_kinds(r));
  EXPECT_EQ(v.effects.front().id, "wind_dryden");
  EXPECT_TRUE(v.effects.front().found);
  EXPECT_NEAR(v.effects.front().size, 1.0, 0.5);
}

TEST(VarianceEffects, GiveForceNoiseThatGrowsWithSpeedNoNameOfTheCatalogue) {
  ResidualSeries r = known_states();
  for (Eigen::Index a = 0; a < 3; ++a) {
    const std::vector<double> n = white(340 + static_cast<std::uint64_t>(a), 0.15);
    for (std::size_t i = 0; i < kAll; ++i)
      r.whitened.steps[i].col(0) += (n[i] * r.state[i].v_B_m_s.norm() * r.state[i].whitened_by_wrench.col(a)).cast<float>();
  }
  const VarianceResult v = variance_effects(r, variance_kinds(r));
  EXPECT_EQ(v.effects.front().what, "force noise that grows with speed");
  for (const VarianceEffect& e : v.effects) EXPECT_FALSE(e.found && !e.id.empty()) << e.id;
}

TEST(VarianceEffects, SayWhatTheyCouldNotTest) {
  const VarianceResult v = variance_effects(known_states(), variance_kinds(known_states()));
  EXPECT_EQ(effect(v, "rotor_imbalance").untested, "the fit used no accelerometer");
}

}  // namespace
}  // namespace rotorloop::diagnose
