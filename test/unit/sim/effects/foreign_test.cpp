// What no catalogue knows: each does what its file says, and none of them stands where a user or a diagnosis would look for names.
#include <gtest/gtest.h>

#include <algorithm>

#include "sim/effects/lists.hpp"
#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;
using Vec = Eigen::Vector3d;

BodyMotion flying_at(double time_s, double speed_m_s) {
  BodyMotion m;
  m.time_s = time_s;
  m.v_air_B_m_s = m.v_W_m_s = {speed_m_s, 0.0, 0.0};
  m.density_kg_m3 = 1.225;
  return m;
}

TEST(ForeignEffects, AreFoundByIdButStandInNoListOfKnownEffects) {
  for (const EffectInfo* e : foreign_effects()) {
    EXPECT_EQ(find_effect(e->id), e);
    EXPECT_EQ(std::ranges::count(builtin_effects(), e), 0) << e->id;
    EXPECT_EQ(use_known_effect("none_such").find(e->id), std::string::npos) << e->id;
  }
}

TEST(ForeignEffects, ActInASetTogetherWithKnownOnes) {
  EffectSet set;
  set.add("foreign_swinging_antenna", 0.01);
  set.add("body_torque_bias", 0.005);
  PlantSetup setup = reference_setup();
  set.prepare(setup);
  Wrench w;
  set.add_to(w, flying_at(0.0, 0.0));
  EXPECT_NEAR(w.moment_B_N_m.x(), 0.01, 1e-12);
  EXPECT_NEAR(w.moment_B_N_m.z(), 0.005, 1e-12);
}

TEST(TorqueBursts, StrikeOnceWithin1p5SecondsForTheirLengthAndWithAtMostTheirSize) {
  const auto effect = make("foreign_torque_bursts", 0.03);
  PlantSetup setup = reference_setup();
  effect->prepare(setup);
  double struck_s = 0.0, largest_N_m = 0.0;
  for (int i = 0; i < 30'000; ++i) {
    const double moment_N_m = wrench_of(*effect, flying_at(1e-3 * i, 0.0)).moment_B_N_m.norm();
    if (moment_N_m > 0.0) struck_s += 1e-3;
    largest_N_m = std::max(largest_N_m, moment_N_m);
  }
  EXPECT_NEAR(struck_s, 20 * 0.2, 0.05);  // 30 s: 20 bursts of 0.2 s
  EXPECT_LE(largest_N_m, 0.03);
  EXPECT_GE(largest_N_m, 0.015);
}

TEST(TorqueBursts, FallElsewhereWithAnotherSeed) {
  double difference = 0.0;
  const auto a = make("foreign_torque_bursts", 0.03), b = make("foreign_torque_bursts", 0.03);
  PlantSetup setup = reference_setup();
  a->prepare(setup);
  setup.seed = 2;
  b->prepare(setup);
  for (int i = 0; i < 3000; ++i)
    difference += (wrench_of(*a, flying_at(1e-3 * i, 0.0)).moment_B_N_m - wrench_of(*b, flying_at(1e-3 * i, 0.0)).moment_B_N_m).norm();
  EXPECT_GT(difference, 1.0);
}

TEST(UpdraftColumn, RisesAtItsPlaceAloneAndFadesWithin3Radii) {
  const auto effect = make("foreign_updraft_column", 3.0);
  const auto rise_m_s = [&](double x_m, double y_m) {
    Air air;
    effect->air({x_m, y_m, 2.0}, 0.0, air);
    EXPECT_EQ(air.wind_W_m_s.head<2>().norm(), 0.0);
    return air.wind_W_m_s.z();
  };
  EXPECT_DOUBLE_EQ(rise_m_s(4.0, 1.0), 3.0);
  EXPECT_NEAR(rise_m_s(4.0 + 1.5, 1.0), 3.0 * 0.3679, 1e-3);
  EXPECT_LT(rise_m_s(4.0, 1.0 + 4.5), 1e-3);
}

TEST(SwingingAntenna, TurnsItsTorqueAtItsFrequencyWhateverTheVehicleDoes) {
  const auto effect = make("foreign_swinging_antenna", 0.01, {{"frequency_Hz", 2.0}});
  for (const double speed_m_s : {0.0, 9.0}) {
    EXPECT_LT((wrench_of(*effect, flying_at(0.0, speed_m_s)).moment_B_N_m - Vec(0.01, 0.0, 0.0)).norm(), 1e-12);
    EXPECT_LT((wrench_of(*effect, flying_at(0.125, speed_m_s)).moment_B_N_m - Vec(0.0, 0.006, 0.0)).norm(), 1e-12);
    EXPECT_LT((wrench_of(*effect, flying_at(0.25, speed_m_s)).moment_B_N_m - Vec(-0.01, 0.0, 0.0)).norm(), 1e-12);
  }
}

TEST(StickingHatch, DragsAt3MetresPerSecondOnlyAfterItWasTornOpenAbove5) {
  const auto effect = make("foreign_sticking_hatch", 0.01);
  const auto drag_N = [&](double speed_m_s) {
    effect->advance(flying_at(0.0, speed_m_s), 1e-3);
    return -wrench_of(*effect, flying_at(0.0, speed_m_s)).force_B_N.x();
  };
  EXPECT_EQ(drag_N(3.0), 0.0);
  EXPECT_NEAR(drag_N(6.0), 0.36, 1e-12);
  EXPECT_NEAR(drag_N(3.0), 0.09, 1e-12);
  EXPECT_EQ(drag_N(1.0), 0.0);
  EXPECT_EQ(drag_N(3.0), 0.0);
}

TEST(ProductMoment, TurnsNeitherATurnAtRestNorAStraightPassButTheirProduct) {
  const auto effect = make("foreign_product_moment", 2e-3);
  const auto moment = [&](double rate_rad_s, double speed_m_s) {
    BodyMotion m = flying_at(0.0, speed_m_s);
    m.w_B_rad_s.z() = rate_rad_s;
    return wrench_of(*effect, m).moment_B_N_m;
  };
  EXPECT_EQ(moment(5.0, 0.0).norm(), 0.0);
  EXPECT_EQ(moment(0.0, 9.0).norm(), 0.0);
  EXPECT_LT((moment(5.0, 2.0) - Vec(0.02, 0.0, 0.0)).norm(), 1e-12);
}

TEST(BladeFlutter, CostsThrustInItsBandOfRotorSpeedAloneAndNoTorque) {
  const auto effect = make("foreign_blade_flutter", 0.08);
  const auto left = [&](double omega_rad_s) {
    const RotorSite s = site(0, some_motion(), omega_rad_s);
    RotorLoads loads;
    loads.force_R_N = {0.1, 0.0, 2.0};
    loads.shaft_torque_N_m = 0.03;
    effect->rotor_loads(s, loads);
    EXPECT_EQ(loads.force_R_N.x(), 0.1);
    EXPECT_EQ(loads.shaft_torque_N_m, 0.03);
    return loads.force_R_N.z() / 2.0;
  };
  EXPECT_DOUBLE_EQ(left(1030.0), 0.92);
  EXPECT_EQ(left(979.0), 1.0);
  EXPECT_EQ(left(1081.0), 1.0);
}

}  // namespace
}  // namespace rotorloop::sim
