// Wind, density, a tether and a slung load: directions, statistics, conserved quantities.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/plant/flight_dynamics.hpp"
#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

Air air_of(const Effect& e, const Eigen::Vector3d& p = Eigen::Vector3d::Zero(), double t = 0.0) {
  Air a{{0.0, 0.0, 0.0}, 1.2};
  e.air(p, t, a);
  return a;
}

TEST(WindSteady, BlowsTowardsItsHeadingEverywhere) {
  EXPECT_LT((air_of(*make("wind_steady", 3.0)).wind_W_m_s - Eigen::Vector3d(3, 0, 0)).norm(), 1e-12);
  EXPECT_LT(
      (air_of(*make("wind_steady", 3.0, {{"towards_deg", 90.0}, {"up_m_s", 0.5}}), {7, 8, 9}, 5.0).wind_W_m_s - Eigen::Vector3d(0, 3, 0.5))
          .norm(),
      1e-12);
}
TEST(WindSteady, CarriesAFreeBodyAlongUntilItFeelsNoAir) {
  PlantSetup setup = reference_setup();
  setup.body.gravity_m_s2 = 0.0;
  setup.body.drag_xy_N_s2_m2 = 0.5;
  EffectSet effects;
  effects.add("wind_steady", 3.0);
  effects.prepare(setup);
  FlightDynamics d(setup, {&rotor(), &rotor(), &rotor(), &rotor()}, std::move(effects), at_height(10.0));
  for (int i = 0; i < 40'000; ++i) d.step(Four{});
  EXPECT_NEAR(d.airframe().state().v_W_m_s.x(), 3.0, 0.1);
  EXPECT_NEAR(d.airframe().state().v_W_m_s.y(), 0.0, 1e-12);
}
TEST(WindShear, GrowsLinearlyWithHeightFromItsReference) {
  const auto e = make("wind_shear", 0.5, {{"reference_height_m", 2.0}});
  PlantSetup s = reference_setup();
  s.body.ground_z_m = 1.0;
  e->prepare(s);
  EXPECT_NEAR(air_of(*e, {0, 0, 3.0}).wind_W_m_s.x(), 0.0, 1e-15);
  EXPECT_NEAR(air_of(*e, {0, 0, 5.0}).wind_W_m_s.x(), 1.0, 1e-15);
  EXPECT_NEAR(air_of(*e, {4, 4, 1.0}).wind_W_m_s.x(), -1.0, 1e-15);
}
TEST(AirDensity, ScalesTheDensityAloneAndEverythingAerodynamicFollows) {
  const auto e = make("air_density", 0.9);
  EXPECT_NEAR(air_of(*e).density_kg_m3, 1.08, 1e-15);
  const BodyMotion m = some_motion();
  RotorSite s = site(0, m);
  const double before_N = solved(s).force_R_N.z();
  s.condition.density_kg_m3 *= 0.9;
  EXPECT_NEAR(solved(s).force_R_N.z() / before_N, 0.885, 0.015) << "the Reynolds number takes a little on top of the 10 %";
}

// Samples of one component every `stride` steps, all seeds joined.
struct Statistics {
  double mean, variance, correlation;  // at one stride
};
Statistics of(const std::vector<double>& x) {
  double sum = 0.0, squares = 0.0, products = 0.0;
  for (const double v : x) sum += v;
  const double mean = sum / static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    squares += (x[i] - mean) * (x[i] - mean);
    if (i > 0) products += (x[i] - mean) * (x[i - 1] - mean);
  }
  return {mean, squares / static_cast<double>(x.size()), products / squares};
}
TEST(WindDryden, HasItsVarianceAndLengthAlongAcrossAndUp) {
  // At 5 m height: L_u = 5 / (0.177 + 0.0135)^1.2 = 36.6 m, L_w / 2 = 2.5 m, sigma_w = sigma_u (0.1905)^0.4.
  const auto e = make("wind_dryden", 2.0, {{"airspeed_m_s", 20.0}});
  PlantSetup s = reference_setup();
  s.seed = 7;
  e->prepare(s);
  std::vector<double> u, v, w;
  const BodyMotion m = some_motion();
  constexpr int kStride = 200;  // 0.1 s, 2 m
  for (int i = 0; i < 12'000 * kStride; ++i) {
    if (i % kStride == 0) {
      const Eigen::Vector3d wind = air_of(*e).wind_W_m_s;
      u.push_back(wind.x());
      v.push_back(wind.y());
      w.push_back(wind.z());
    }
    e->advance(m, 5e-4);
  }
  const double sigma_w = 2.0 * std::pow(0.177 + 0.000823 * 5.0 / 0.3048, 0.4);
  const double length_u = 5.0 / std::pow(0.177 + 0.000823 * 5.0 / 0.3048, 1.2);
  EXPECT_NEAR(std::sqrt(of(u).variance), 2.0, 0.25) << "some 650 independent gusts";
  EXPECT_NEAR(std::sqrt(of(v).variance), 2.0, 0.2);
  EXPECT_NEAR(std::sqrt(of(w).variance), sigma_w, 0.05);
  EXPECT_NEAR(of(u).correlation, std::exp(-2.0 / length_u), 0.02);
  EXPECT_NEAR(of(v).correlation, std::exp(-4.0 / length_u), 0.02);
  EXPECT_NEAR(of(w).correlation, std::exp(-2.0 / 2.5), 0.03);
}
TEST(WindDryden, DiffersBySeedAndRepeatsBitByBit) {
  const auto gust = [](std::uint64_t seed) {
    const auto e = make("wind_dryden", 1.0);
    PlantSetup s = reference_setup();
    s.seed = seed;
    e->prepare(s);
    for (int i = 0; i < 100; ++i) e->advance(some_motion(), 5e-4);
    return air_of(*e).wind_W_m_s;
  };
  EXPECT_EQ(gust(3), gust(3));
  EXPECT_NE(gust(3), gust(4));
}

TEST(Tether, PullsTowardsItsAnchorBeyondTheSlackAndNeverPushes) {
  BodyMotion m;
  m.p_W_m = {2.0, 0.0, 0.0};
  const auto e = make("tether", 3.0, {{"slack_m", 0.5}});
  EXPECT_LT((wrench_of(*e, m).force_B_N - Eigen::Vector3d(-4.5, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(wrench_of(*e, m).moment_B_N_m.norm(), 0.0);
  m.p_W_m = {0.4, 0.0, 0.0};
  EXPECT_EQ(wrench_of(*e, m).force_B_N.norm(), 0.0);
  m.p_W_m = {0.6, 0.0, 0.0};
  m.v_W_m_s = {-100.0, 0.0, 0.0};
  EXPECT_EQ(wrench_of(*e, m).force_B_N.norm(), 0.0) << "damping does not push";
}

TEST(WorldForce, KeepsSizeAndDirectionInTheWorldInEveryAttitudePlaceAndMotion) {
  const auto e = make("world_force", 0.2, {{"towards_deg", 30.0}});
  const Eigen::Vector3d expected_W_N(0.2 * std::cos(3.14159265358979 / 6), 0.1, 0.0);
  for (const double turn_rad : {0.0, 1.0, -2.5}) {
    BodyMotion m = some_motion();
    m.R_WB = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    m.p_W_m = {10.0 * turn_rad, -3.0, 7.0};
    const Wrench w = wrench_of(*e, m);
    EXPECT_LT((m.R_WB * w.force_B_N - expected_W_N).norm(), 1e-12) << turn_rad;
    EXPECT_EQ(w.moment_B_N_m.norm(), 0.0);
  }
}

TEST(HeightPull, IsTheWeightOfTheCableBetweenGroundAndVehicleInEveryAttitude) {
  const auto e = make("height_pull", 0.05);
  PlantSetup setup = reference_setup();
  setup.body.ground_z_m = 1.0;
  e->prepare(setup);
  BodyMotion m = some_motion();
  m.R_WB = Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -1, 2).normalized()).toRotationMatrix();
  for (const double z_m : {1.0, 3.0, 9.0}) {
    m.p_W_m = {4.0, -5.0, z_m};
    const Wrench w = wrench_of(*e, m);
    EXPECT_LT((m.R_WB * w.force_B_N - Eigen::Vector3d(0, 0, -0.05 * (z_m - 1.0))).norm(), 1e-12) << z_m;
    EXPECT_EQ(w.moment_B_N_m.norm(), 0.0);
  }
  m.p_W_m.z() = 0.5;
  EXPECT_EQ(wrench_of(*e, m).force_B_N.norm(), 0.0) << "a cable that lies on the ground pulls nothing, and never pushes";
}

TEST(SlungLoad, PullsAHeldBodyWithItsWeight) {
  const auto e = make("slung_load", 0.1);
  PlantSetup setup = reference_setup();
  e->prepare(setup);
  BodyMotion held;
  held.p_W_m.z() = 10.0;
  for (int i = 0; i < 4000; ++i) {
    held.time_s = 5e-4 * i;
    e->advance(held, 5e-4);
  }
  EXPECT_NEAR(wrench_of(*e, held).force_B_N.z(), -0.1 * kGravity_m_s2, 1e-6);
  EXPECT_LT(wrench_of(*e, held).moment_B_N_m.norm(), 1e-9) << "hangs below the centre of mass";
}
TEST(SlungLoad, HangsToLeewardUnderAHeldBodyByTheDragOfTheWindAndItsDensity) {
  for (const double density_kg_m3 : {1.225, 0.98}) {
    const auto e = make("slung_load", 0.1, {{"drag_N_s2_m2", 0.004}});
    PlantSetup setup = reference_setup();
    e->prepare(setup);
    BodyMotion held;
    held.p_W_m.z() = 10.0;
    held.R_WB = Eigen::AngleAxisd(0.5236, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    held.v_air_B_m_s = held.R_WB.transpose() * Eigen::Vector3d(-5.0, 0.0, 0.0);  // the wind blows towards +x
    held.density_kg_m3 = density_kg_m3;
    for (int i = 0; i < 240'000; ++i) e->advance(held, 5e-4);  // until its own drag has damped the swing
    const Eigen::Vector3d pull_W_N = held.R_WB * wrench_of(*e, held).force_B_N;
    EXPECT_NEAR(pull_W_N.x(), 0.004 * 25.0 * density_kg_m3 / 1.225, 1e-3) << density_kg_m3;
    EXPECT_NEAR(pull_W_N.z(), -0.1 * kGravity_m_s2, 1e-3);
  }
}
TEST(SlungLoad, TheStringOfTheHeaviestLoadStopsRingingUnderAFreeBodyAtTheLeastDampingThatAFileMayGive) {
  const EffectInfo* info = find_effect("slung_load");
  EffectValues values = effect_values(*info, info->parameter.max);
  std::size_t damping = 0;
  while (info->options[damping].key != "string_damping") ++damping;
  values[damping + 1] = info->options[damping].min;
  EffectSet effects;
  effects.add("slung_load", values);
  PlantSetup setup = reference_setup();
  effects.prepare(setup);
  FlightDynamics flight(setup, {&rotor(), &rotor(), &rotor(), &rotor()}, std::move(effects), at_height(50.0));
  const Four omega{1140, 1140, 1140, 1140};  // carries both, nearly
  double early_N = 0.0, late_N = 0.0, before_N = 0.0;
  for (int i = 0; i < 6000; ++i) {
    flight.evaluate_rotors(omega);
    flight.step(Four{});
    const double pull_N = flight.airframe().wrench().further.force_B_N.z(), change_N = std::fabs(pull_N - before_N);
    before_N = pull_N;
    if (i > 1 && i < 200) early_N = std::max(early_N, change_N);
    if (i > 5000) late_N = std::max(late_N, change_N);
  }
  EXPECT_GT(early_N, 1e-3) << "it did ring";
  EXPECT_LT(late_N, 1e-3 * early_N);
}
TEST(SlungLoad, SwingsLikeAPendulumFromAHeldBodyAndLosesNoMoreThanItsDrag) {
  const auto e = make("slung_load", 0.1, {{"length_m", 1.0}, {"drag_N_s2_m2", 0.0}});
  PlantSetup setup = reference_setup();
  e->prepare(setup);
  BodyMotion held;
  held.p_W_m.z() = 10.0;
  e->advance(held, 5e-4);
  // Drawn 5 cm to the side by moving the body there: the load follows with its own period, 2 pi sqrt(L / g) = 2.006 s.
  held.p_W_m.x() = 0.05;
  double last = 0.0, first_peak = 0.0, last_peak = 0.0, last_zero_s = 0.0;
  std::vector<double> half_periods;
  double peak = 0.0;
  for (int i = 1; i < 24'000; ++i) {
    held.time_s = 5e-4 * i;
    e->advance(held, 5e-4);
    const double side_N = wrench_of(*e, held).force_B_N.x();
    peak = std::max(peak, std::fabs(side_N));
    if (last * side_N < 0.0) {
      if (last_zero_s > 0.0) {
        half_periods.push_back(held.time_s - last_zero_s);
        if (first_peak == 0.0) first_peak = peak;  // the string still rings in the swing before
      }
      last_zero_s = held.time_s;
      last_peak = peak;
      peak = 0.0;
    }
    last = side_N;
  }
  ASSERT_GE(half_periods.size(), 8u);
  double mean = 0.0;
  for (const double h : half_periods) mean += h / static_cast<double>(half_periods.size());
  EXPECT_NEAR(2.0 * mean, 2.006, 0.01);
  EXPECT_NEAR(last_peak / first_peak, 1.0, 0.02) << "no drag: the swing stays";
  EXPECT_LE(last_peak, first_peak * 1.001) << "and never grows";
}
TEST(SlungLoad, UnderABodyOnARailItSwingsFasterByTheRecoilAndTogetherTheyKeepTheirMomentum) {
  constexpr double kLoad_kg = 0.2, kLength_m = 0.5, kKick_m_s = 0.1;
  const auto e = make("slung_load", kLoad_kg, {{"length_m", kLength_m}, {"drag_N_s2_m2", 0.0}});
  PlantSetup setup = reference_setup();
  e->prepare(setup);
  BodyMotion m;
  m.p_W_m.z() = 10.0;
  e->advance(m, 5e-4);
  m.v_W_m_s.x() = kKick_m_s;
  const double common_m_s = kKick_m_s * kMass_kg / (kMass_kg + kLoad_kg);
  std::vector<double> crossings_s;
  double sum_m_s = 0.0, before = kKick_m_s;
  int samples = 0;
  for (int i = 1; crossings_s.size() < 21; ++i) {
    ASSERT_LT(i, 100'000);
    m.time_s = 5e-4 * i;
    m.v_W_m_s.x() += 5e-4 / kMass_kg * wrench_of(*e, m).force_B_N.x();
    m.p_W_m.x() += 5e-4 * m.v_W_m_s.x();
    e->advance(m, 5e-4);
    if ((m.v_W_m_s.x() - common_m_s) * (before - common_m_s) < 0.0) crossings_s.push_back(m.time_s);
    if (!crossings_s.empty()) {
      sum_m_s += m.v_W_m_s.x();
      ++samples;
    }
    before = m.v_W_m_s.x();
  }
  const double period_s = (crossings_s.back() - crossings_s.front()) / 10.0;
  EXPECT_NEAR(period_s, 2.0 * 3.14159265 * std::sqrt(kLength_m / kGravity_m_s2 / (1.0 + kLoad_kg / kMass_kg)), 0.01);
  EXPECT_NEAR(sum_m_s / samples, common_m_s, 1e-3);
}

}  // namespace
}  // namespace rotorloop::sim
