// What holds of every effect (nothing at its neutral value, something at the ends of its range), and the set that holds them.
#include "sim/effects/effect_set.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <sstream>

#include "host/base/error.hpp"
#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;
using ::testing::AllOf;
using ::testing::HasSubstr;

// All that an effect can change, as one list of numbers, after some steps in a fixed motion near the ground.
struct Trace {
  std::vector<double> values;
  void add(const Eigen::Vector3d& v) { values.insert(values.end(), v.data(), v.data() + 3); }
  void add(double v) { values.push_back(v); }
};

void add_setup(Trace& t, const PlantSetup& s) {
  t.add(s.body.mass_kg);
  for (int i = 0; i < 9; ++i) t.add(s.body.inertia_kg_m2.data()[i]);
  t.add(s.body.com_offset_m);
  t.add(s.body.drag_xy_N_s2_m2);
  t.add(s.body.drag_z_N_s2_m2);
  t.add(s.body.density_kg_m3);
  for (const RotorMount& r : s.body.rotors) {
    t.add(r.hub_m);
    t.add(r.tilt_rad.x());
    t.add(r.tilt_rad.y());
  }
  for (const DriveParameters& d : s.drive) {
    t.add(d.motor.resistance_ohm);
    t.add(d.motor.flux_linkage_Wb);
  }
  t.add(s.battery.resistance_ohm);
  t.add(s.battery.relaxation_ohm);
  t.add(s.battery.capacity_A_s);
  t.add(s.imu.vibration);
  t.add(1e6 * s.imu.rectification_m);
  for (Eigen::Index i = 0; i < 3; ++i) {
    t.add(Eigen::Vector3d(s.imu.gyro_gain.row(i)));
    t.add(Eigen::Vector3d(s.imu.accel_gain.row(i)));
  }
  t.add(1e3 * s.pose.stamp_rate_error);
  t.add(s.pose.stamp_error_s);
  t.add(s.pose.stamp_jitter_s);
  t.add(s.pose.scale_error);
  t.add(s.pose.tilt_rad.x());
  t.add(s.pose.tilt_rad.y());
  t.add(s.pose.latency_s);
  t.add(s.pose.drift_m);
  t.add(s.pose.offset_B_m);
  for (const EscSetup& e : s.esc) {
    t.add(e.speed_scale);
    t.add(e.speed_noise_rad_s);
    t.add(static_cast<double>(e.report_delay_ns));
    t.add(e.lag_s);
  }
}

Trace trace(Effect* effect, const BodyMotion& body) {
  Trace t;
  PlantSetup setup = reference_setup();
  if (effect) effect->prepare(setup);
  add_setup(t, setup);
  BodyMotion now = body;
  for (int step = 0; step < 20; ++step) {
    now.time_s = body.time_s + 5e-4 * step;
    now.p_W_m = body.p_W_m + 5e-4 * step * body.v_W_m_s;
    Air air{{0.5, -0.3, 0.0}, 1.2};
    if (effect) effect->air(now.p_W_m, now.time_s, air);
    t.add(air.wind_W_m_s);
    t.add(air.density_kg_m3);
    for (std::size_t i = 0; i < 4; ++i) {
      RotorSite s = site(i, now, 945.0 + 3.0 * step);
      RotorCondition c = s.condition;
      if (effect) effect->rotor_condition(s, c);
      s.condition = c;
      t.add(c.v_R_m_s);
      t.add(c.w_R_rad_s);
      t.add(c.density_kg_m3);
      RotorLoads l = s.bare = solved(s);
      if (effect) effect->rotor_loads(s, l);
      t.add(l.force_R_N);
      t.add(l.moment_R_N_m);
      t.add(l.shaft_torque_N_m);
    }
    Wrench w;
    if (effect) effect->body_loads(now, w);
    t.add(w.force_B_N);
    t.add(w.moment_B_N_m);
    if (effect) effect->advance(now, 5e-4);
  }
  return t;
}

// Forward flight near the ground, and a fast descent: no effect sleeps in both.
std::vector<BodyMotion> motions() {
  BodyMotion low = some_motion();
  low.p_W_m.z() = 0.15;
  BodyMotion descent = some_motion();
  descent.v_W_m_s = {0.5, 0.0, -5.0};
  descent.v_air_B_m_s = descent.R_WB.transpose() * descent.v_W_m_s;
  return {low, descent};
}

double largest_difference(const Trace& a, const Trace& b) {
  EXPECT_EQ(a.values.size(), b.values.size());
  double worst = 0.0;
  for (std::size_t i = 0; i < a.values.size(); ++i)
    worst = std::max(worst, std::fabs(a.values[i] - b.values[i]) / (1.0 + std::fabs(b.values[i])));
  return worst;
}

double change(const EffectInfo& info, double value) {
  double worst = 0.0;
  for (const BodyMotion& m : motions()) {
    const auto effect = info.make(effect_values(info, value));
    worst = std::max(worst, largest_difference(trace(effect.get(), m), trace(nullptr, m)));
  }
  return worst;
}

TEST(EveryEffect, ChangesNothingAtItsNeutralValueAndSomethingFiniteAtTheEndsOfItsRange) {
  for (const EffectInfo* e : builtin_effects()) {
    const EffectParameter& p = e->parameter;
    EXPECT_LE(p.min, p.neutral) << e->id;
    EXPECT_GE(p.max, p.neutral) << e->id;
    EXPECT_LT(p.min, p.max) << e->id;
    if (p.origin == ParameterOrigin::drive) continue;  // always at the size that the drive gives it
    EXPECT_LE(change(*e, p.neutral), 1e-12) << e->id << " acts at its neutral value";
    for (const double value : {p.min, p.max}) {
      if (value == p.neutral) continue;
      const double changed = change(*e, value);
      EXPECT_TRUE(std::isfinite(changed)) << e->id << " at " << value;
      EXPECT_GT(changed, 1e-9) << e->id << " does nothing at " << value;
    }
  }
}
TEST(EveryEffect, StartsAfreshInEachFlight) {
  for (const EffectInfo* e : builtin_effects()) {
    const auto a = e->make(effect_values(*e, e->parameter.max)), b = e->make(effect_values(*e, e->parameter.max));
    const BodyMotion m = motions()[0];
    EXPECT_EQ(trace(a.get(), m).values, trace(b.get(), m).values) << e->id;
  }
}
TEST(EveryEffect, HasOptionsWhoseFallbackIsInRange) {
  for (const EffectInfo* e : builtin_effects()) {
    EXPECT_LT(e->options.size(), kMaxEffectValues) << e->id;
    for (const EffectOption& o : e->options) {
      EXPECT_LE(o.min, o.fallback) << e->id << "." << o.key;
      EXPECT_GE(o.max, o.fallback) << e->id << "." << o.key;
    }
  }
}

std::string refusal(std::string_view id, const EffectValues& values) {
  EffectSet set;
  set.add("blockage_strut", 0.05);
  try {
    set.add(id, values);
  } catch (const Error& e) {
    return e.what();
  }
  return "(no error)";
}
TEST(EffectSet, AnUnknownIdIsRefusedWithTheListOfKnownOnes) {
  EXPECT_THAT(refusal("ground_efect", {1.0}), AllOf(HasSubstr("effect \"ground_efect\" is not known"), HasSubstr("use one of: "),
                                                    HasSubstr("rotor_body_interference"), HasSubstr("gyroscopic")));
}
TEST(EffectSet, AnEffectTwiceOrAValueOutOfRangeIsRefused) {
  EXPECT_THAT(refusal("blockage_strut", {0.05}), HasSubstr("switched on twice"));
  EXPECT_THAT(refusal("rotor_body_interference", {25.0}), HasSubstr("k_H = 25 is outside 1 to 4"));
  EXPECT_THAT(refusal("rotor_body_interference", {std::numeric_limits<double>::quiet_NaN()}), HasSubstr("is outside"));
  EXPECT_THAT(refusal("rotor_speed_scale", {0.01, 7.0}), HasSubstr("rotor = 7 is outside 1 to 4"));
  EXPECT_THAT(refusal("rotor_speed_scale", {0.01, 1.5}), HasSubstr("rotor = 1.5 is not a whole number"));
}
TEST(EffectSet, WhatIsSwitchedOffDoesNotAct) {
  EffectSet set;
  const BodyMotion m = some_motion();
  RotorLoads l = some_loads();
  set.rotor_loads(site(0, m), l);
  EXPECT_EQ(l.force_R_N, some_loads().force_R_N);
  Wrench w;
  set.add_to(w, m);
  EXPECT_EQ(w.moment_B_N_m.norm() + w.force_B_N.norm(), 0.0);
}
TEST(EffectSet, TheOrderOfSwitchingOnDoesNotMatter) {
  EffectSet ab, ba;
  ab.add("blockage_strut", 0.08);
  ab.add("rotor_body_interference", 2.5);
  ba.add("rotor_body_interference", 2.5);
  ba.add("blockage_strut", 0.08);
  const BodyMotion m = some_motion();
  RotorLoads l1 = some_loads(), l2 = some_loads();
  ab.rotor_loads(site(0, m), l1);
  ba.rotor_loads(site(0, m), l2);
  EXPECT_EQ(l1.force_R_N, l2.force_R_N);
  EXPECT_EQ(l1.force_R_N.x(), -0.5);
  EXPECT_TRUE(ab.has("blockage_strut"));
  EXPECT_FALSE(ab.has("gyroscopic"));
  EXPECT_EQ(ab.size(), 2u);
}

}  // namespace
}  // namespace rotorloop::sim
