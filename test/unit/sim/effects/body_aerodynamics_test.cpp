// The air on the body: which way each force and moment points, how large it is on the reference vehicle, and what it never does.
#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;
using Vec = Eigen::Vector3d;
using Options = std::vector<std::pair<std::string_view, double>>;

constexpr double kStandard_kg_m3 = 1.225;
const double k45 = 8.5 / std::sqrt(2.0);  // 8.5 m/s at 45 degrees of sideslip, per axis

// At the standard density, unless told otherwise.
BodyMotion body_in_air(const Vec& v_air_B_m_s, const Vec& w_B_rad_s = Vec::Zero(), double density_kg_m3 = kStandard_kg_m3) {
  BodyMotion m;
  m.v_W_m_s = m.v_air_B_m_s = v_air_B_m_s;
  m.w_B_rad_s = w_B_rad_s;
  m.density_kg_m3 = density_kg_m3;
  return m;
}
// Force and moment of one effect on the reference body.
Wrench of(std::string_view id, double value, const BodyMotion& m, const Options& options = {}) {
  const auto effect = make(id, value, options);
  PlantSetup setup = reference_setup();
  effect->prepare(setup);
  return wrench_of(*effect, m);
}
void expect_vector(const Vec& actual, const Vec& expected, double tolerance = 1e-15) {
  EXPECT_LT((actual - expected).norm(), tolerance) << actual.transpose() << " instead of " << expected.transpose();
}

TEST(ParasiticDrag, ScalesBothDragAreasAndNothingElseOfTheVehicle) {
  for (const double share : {0.0, 0.5, 3.0}) {
    PlantSetup s = reference_setup();
    const auto effect = make("parasitic_drag", share);
    effect->prepare(s);
    EXPECT_DOUBLE_EQ(s.body.drag_xy_N_s2_m2, share * 0.0055);
    EXPECT_DOUBLE_EQ(s.body.drag_z_N_s2_m2, share * 0.0185);
    EXPECT_EQ(s.body.mass_kg, reference_setup().body.mass_kg);
    EXPECT_EQ(wrench_of(*effect, body_in_air({8, 0, 0})).force_B_N.norm(), 0.0) << "the airframe drags, not the effect";
  }
}
TEST(ParasiticDrag, IsAbout0p40NewtonAt8p5And0p79At12AndVertically0p18At3p1) {
  const ParasiticDrag drag = reference_setup().body.drag();
  EXPECT_NEAR(drag.force_B_N({8.5, 0, 0}, 1.2).x(), -0.40, 0.01);
  EXPECT_NEAR(drag.force_B_N({0, -12, 0}, 1.2).y(), 0.79, 0.01);
  EXPECT_NEAR(drag.force_B_N({0, 0, 3.1}, 1.2).z(), -0.18, 0.005);
}

TEST(LinearDrag, OpposesTheMotionAlongEachAxisInProportionToSpeed) {
  expect_vector(of("linear_drag", 0.05, body_in_air({8, 0, 0})).force_B_N, {-0.4, 0, 0});
  expect_vector(of("linear_drag", 0.05, body_in_air({0, -4, 0})).force_B_N, {0, 0.2, 0});
  expect_vector(of("linear_drag", 0.05, body_in_air({0, 0, 2})).force_B_N, {0, 0, -0.1});
  expect_vector(of("linear_drag", 0.05, body_in_air({8, 0, 2}), {{"z_share", 0.0}}).force_B_N, {-0.4, 0, 0});
  EXPECT_EQ(of("linear_drag", 0.05, body_in_air({8, 3, 2})).moment_B_N_m.norm(), 0.0);
}

TEST(DragCentreOffset, TurnsTheBodyWithoutMovingIt) {
  const Vec above = of("drag_centre_offset", 0.02, body_in_air({8.5, 0, 0})).moment_B_N_m;
  EXPECT_LT(above.y(), 0.0) << "drag above the centre of mass raises the nose in forward flight";
  EXPECT_NEAR(above.y(), -0.008, 0.0005) << "0.40 N on 20 mm";
  EXPECT_GT(of("drag_centre_offset", 0.02, body_in_air({0, 8.5, 0})).moment_B_N_m.x(), 0.0) << "and the left side in flight to the left";
  EXPECT_GT(of("drag_centre_offset", 0.0, body_in_air({0, 8.5, 0}), {{"x_m", -0.02}}).moment_B_N_m.z(), 0.0)
      << "drag behind the centre of mass turns the nose into the motion";
  EXPECT_EQ(of("drag_centre_offset", 0.05, body_in_air({8, 3, 2})).force_B_N.norm(), 0.0);
}
TEST(DragCentreOffset, UsesTheDragOfTheAirframeItself) {
  AirframeState s = at_height(10);
  s.v_W_m_s = {6, -3, 2};
  const AirframeConfig body = reference_setup().body;
  Airframe plane(body, s);
  plane.step(FourLoads{}, Four{}, Four{});
  const Vec r(0.01, -0.02, 0.03);
  const Vec m = of("drag_centre_offset", r.z(), body_in_air(s.v_W_m_s, Vec::Zero(), body.density_kg_m3), {{"x_m", r.x()}, {"y_m", r.y()}})
                    .moment_B_N_m;
  expect_vector(m, r.cross(plane.wrench().drag_force_B_N));
}
TEST(DragCentreOffset, FollowsAScaledParasiticDrag) {
  EffectSet set;
  set.add("drag_centre_offset", 0.02);
  set.add("parasitic_drag", 2.0);
  PlantSetup s = reference_setup();
  set.prepare(s);
  Wrench w;
  set.add_to(w, body_in_air({8.5, 0, 0}));
  expect_vector(w.moment_B_N_m, 2.0 * of("drag_centre_offset", 0.02, body_in_air({8.5, 0, 0})).moment_B_N_m);
}

TEST(BodyLift, GrowsWithTheSquareOfInPlaneSpeedInEveryDirectionAlongBodyZAlone) {
  expect_vector(of("body_lift", 0.002, body_in_air({8.5, 0, 0})).force_B_N, {0, 0, 0.1445});
  expect_vector(of("body_lift", 0.002, body_in_air({0, -8.5, 5})).force_B_N, {0, 0, 0.1445});
  expect_vector(of("body_lift", -0.002, body_in_air({17, 0, 0})).force_B_N, {0, 0, -0.578});
  EXPECT_EQ(of("body_lift", 0.002, body_in_air({0, 0, 5})).force_B_N.norm(), 0.0);
  EXPECT_EQ(of("body_lift", 0.002, body_in_air({8, 3, 1})).moment_B_N_m.norm(), 0.0);
}

TEST(BodyPitchMoment, RaisesTheSideThatMeetsTheAirWhenNegative) {
  EXPECT_LT(of("body_pitch_moment", -5e-4, body_in_air({8.5, 0, 0})).moment_B_N_m.y(), 0.0) << "nose up";
  EXPECT_GT(of("body_pitch_moment", -5e-4, body_in_air({-8.5, 0, 0})).moment_B_N_m.y(), 0.0) << "tail up";
  EXPECT_GT(of("body_pitch_moment", -5e-4, body_in_air({0, 8.5, 0})).moment_B_N_m.x(), 0.0) << "left side up";
  EXPECT_LT(of("body_pitch_moment", -5e-4, body_in_air({0, -8.5, 0})).moment_B_N_m.x(), 0.0) << "right side up";
}
TEST(BodyPitchMoment, IsAbout19To57MillinewtonmetresAt8p5WhateverTheHeading) {
  for (const Vec& v : {Vec(8.5, 0, 0), Vec(0, 8.5, 0), Vec(k45, k45, 0)}) {
    const Wrench w = of("body_pitch_moment", -5e-4, body_in_air(v));
    EXPECT_GT(w.moment_B_N_m.norm(), 0.019);
    EXPECT_LT(w.moment_B_N_m.norm(), 0.057);
    EXPECT_NEAR(w.moment_B_N_m.dot(v), 0.0, 1e-15) << "about the axis across the stream";
    EXPECT_EQ(w.force_B_N.norm(), 0.0);
  }
  EXPECT_EQ(of("body_pitch_moment", -5e-4, body_in_air({0, 0, 5})).moment_B_N_m.norm(), 0.0);
}

TEST(SideslipYawMoment, TurnsTheNoseIntoTheMotionWhenPositiveWithAbout40MillinewtonmetresAt8p5And45Degrees) {
  EXPECT_NEAR(of("sideslip_yaw_moment", 1.1e-3, body_in_air({k45, k45, 0})).moment_B_N_m.z(), 0.040, 0.001)
      << "motion to the left: turn left";
  EXPECT_NEAR(of("sideslip_yaw_moment", 1.1e-3, body_in_air({k45, -k45, 0})).moment_B_N_m.z(), -0.040, 0.001);
  EXPECT_NEAR(of("sideslip_yaw_moment", 1.1e-3, body_in_air({-k45, -k45, 0})).moment_B_N_m.z(), 0.040, 0.001)
      << "a body has no front in this";
}
TEST(SideslipYawMoment, VanishesInFlightAlongTheAxesOfTheBody) {
  for (const Vec& v : {Vec(8.5, 0, 2), Vec(-8.5, 0, 0), Vec(0, 8.5, 0), Vec(0, 0, 8.5)})
    EXPECT_EQ(of("sideslip_yaw_moment", 1e-3, body_in_air(v)).moment_B_N_m.norm(), 0.0);
}

TEST(RateDamping, IsAbout3p9MillinewtonmetresPerRadianPerSecondAgainstEachRate) {
  expect_vector(of("rate_damping", 3.9e-3, body_in_air(Vec::Zero(), {1, 0, 0})).moment_B_N_m, {-3.9e-3, 0, 0});
  expect_vector(of("rate_damping", 3.9e-3, body_in_air(Vec::Zero(), {0, -6.5, 0})).moment_B_N_m, {0, 25.35e-3, 0}, 1e-12);
  expect_vector(of("rate_damping", 3.9e-3, body_in_air(Vec::Zero(), {0, 0, 2}), {{"yaw_share", 0.5}}).moment_B_N_m, {0, 0, -3.9e-3});
}
TEST(QuadraticRateDamping, GrowsWithTheSquareOfTheRate) {
  expect_vector(of("quadratic_rate_damping", 1e-4, body_in_air(Vec::Zero(), {3, 0, 0})).moment_B_N_m, {-9e-4, 0, 0});
  expect_vector(of("quadratic_rate_damping", 1e-4, body_in_air(Vec::Zero(), {-6, 0, 0})).moment_B_N_m, {36e-4, 0, 0});
  expect_vector(of("quadratic_rate_damping", 1e-4, body_in_air(Vec::Zero(), {3, 0, -4})).moment_B_N_m, {-15e-4, 0, 20e-4});
}

TEST(Damping, NeverAddsEnergy) {
  for (double a = 0.0; a < 6.3; a += 0.3) {
    const Vec w(7 * std::cos(a), 5 * std::sin(2 * a), 3 * std::sin(a)), v(9 * std::sin(a), 8 * std::cos(2 * a), 4 * std::cos(a));
    for (const auto id : {"rate_damping", "quadratic_rate_damping", "linear_drag"}) {
      const Wrench x = of(id, find_effect(id)->parameter.max, body_in_air(v, w));
      EXPECT_LT(x.force_B_N.dot(v) + x.moment_B_N_m.dot(w), 0.0) << id;
    }
  }
}

TEST(BodyAerodynamics, IsLinearInItsParameterAndVanishesInStillAir) {
  for (const auto id : {"linear_drag", "drag_centre_offset", "body_lift", "body_pitch_moment", "sideslip_yaw_moment", "rate_damping",
                        "quadratic_rate_damping"}) {
    const double half = 0.5 * find_effect(id)->parameter.max;
    const BodyMotion m = body_in_air({6, -3, 2}, {3, 2, -1});
    const Wrench once = of(id, half, m), twice = of(id, 2 * half, m);
    EXPECT_GT(once.force_B_N.norm() + once.moment_B_N_m.norm(), 1e-3) << id;
    expect_vector(twice.force_B_N, 2 * once.force_B_N, 1e-12);
    expect_vector(twice.moment_B_N_m, 2 * once.moment_B_N_m, 1e-12);
    const Wrench still = of(id, half, body_in_air(Vec::Zero()));
    EXPECT_EQ(still.force_B_N.norm() + still.moment_B_N_m.norm(), 0.0) << id;
  }
}
TEST(BodyAerodynamics, FollowsTheDensityWhereItsLawHasIt) {
  const auto ratio = [](const char* id) {
    const auto size = [&](double density_kg_m3) {
      const Wrench w = of(id, find_effect(id)->parameter.max, body_in_air({6, -3, 2}, {3, 2, -1}, density_kg_m3));
      return w.force_B_N.norm() + w.moment_B_N_m.norm();
    };
    return size(0.5 * kStandard_kg_m3) / size(kStandard_kg_m3);
  };
  for (const auto id : {"drag_centre_offset", "body_lift", "body_pitch_moment", "sideslip_yaw_moment", "quadratic_rate_damping"})
    EXPECT_NEAR(ratio(id), 0.5, 1e-12) << id;
  for (const auto id : {"linear_drag", "rate_damping", "body_force_bias", "body_torque_bias"}) EXPECT_EQ(ratio(id), 1.0) << id;
}
// Mirrored in the xz plane: y of vectors changes sign, x and z of moments.
TEST(BodyAerodynamics, MirroredFlightGivesMirroredLoads) {
  const Vec v(6, -3, 2), w(3, 2, -1), mirror(1, -1, 1);
  for (const auto id : {"linear_drag", "drag_centre_offset", "body_lift", "body_pitch_moment", "sideslip_yaw_moment", "rate_damping",
                        "quadratic_rate_damping"}) {
    const Wrench a = of(id, find_effect(id)->parameter.max, body_in_air(v, w));
    const Wrench b = of(id, find_effect(id)->parameter.max, body_in_air(v.cwiseProduct(mirror), -w.cwiseProduct(mirror)));
    expect_vector(b.force_B_N, a.force_B_N.cwiseProduct(mirror), 1e-12);
    expect_vector(b.moment_B_N_m, -a.moment_B_N_m.cwiseProduct(mirror), 1e-12);
  }
}

TEST(BodyBias, IsTheSameInEveryMotionAndFixedInTheBody) {
  for (const BodyMotion& m : {body_in_air(Vec::Zero()), body_in_air({9, -4, 2}, {5, 2, 1}), some_motion()}) {
    const Wrench force = of("body_force_bias", 0.1, m, {{"x_N", -0.05}, {"y_N", 0.2}});
    expect_vector(force.force_B_N, {-0.05, 0.2, 0.1});
    EXPECT_EQ(force.moment_B_N_m.norm(), 0.0);
    const Wrench torque = of("body_torque_bias", 0.005, m, {{"x_N_m", -0.01}, {"y_N_m", 0.015}});
    expect_vector(torque.moment_B_N_m, {-0.01, 0.015, 0.005});
    EXPECT_EQ(torque.force_B_N.norm(), 0.0);
  }
}

}  // namespace
}  // namespace rotorloop::sim
