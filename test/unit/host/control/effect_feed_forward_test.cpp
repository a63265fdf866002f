// Added terms in the controller: the speeds give the demanded thrust and torque on a vehicle that has the effect by equations of
// its own, forces are leant against, and no term, however wrong, takes the vehicle out of eq. (1)-(5)'s hands.
#include "host/control/effect_feed_forward.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/base/random.hpp"
#include "host/control/gains_file.hpp"
#include "host/control/trajectory_file.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"
#include "test/unit/host/control/test_flight.hpp"
#include "test/unit/host/control/test_terms.hpp"

namespace rotorloop::host {
namespace {

using V3 = Eigen::Vector3d;
using Speeds = std::array<double, kRotors>;

const VehicleModel kVehicle = test::paper_vehicle();
const double kWeight_N = 0.682 * 9.80665;
const std::string kRoot = ROTORLOOP_SOURCE_DIR;

// The test's own vehicle: what of the thrust a rotor gives, and what it feels of the air, in plain arithmetic.
struct Truth {
  double growth = 0.0, weak_third = 0.0, downwash = 0.0, twist_N_m = 0.0;
};
struct Wrench {
  double thrust_N = 0.0;
  V3 torque_N_m = V3::Zero();
};
Wrench produced(const Truth& truth, const Speeds& omega, const V3& v_B, const V3& w_B) {
  const test::QuadTruth quad;
  constexpr double l = 0.0885;
  const V3 com(0.0014, 0.000177, 0.0);
  const double x[4] = {l, -l, l, -l}, y[4] = {-l, l, l, -l}, sign[4] = {-1, -1, 1, 1};
  Wrench out;
  for (int i = 0; i < 4; ++i) {
    V3 v = v_B + w_B.cross(V3(x[i], y[i], 0) - com);
    if (x[i] < 0) v.z() += truth.downwash * std::fabs(v_B.x());
    const double speed = omega[static_cast<std::size_t>(i)];
    double t = test::rotor_thrust(quad, speed, v.z(), std::hypot(v.x(), v.y()));
    t *= 1.0 + truth.growth * (speed / 940.0 - 1.0);
    if (i == 2) t *= 1.0 + truth.weak_third;
    out.thrust_N += t;
    out.torque_N_m += V3((y[i] - com.y()) * t, -(x[i] - com.x()) * t, sign[i] * quad.c_q * speed * speed);
  }
  out.torque_N_m.y() += truth.twist_N_m;
  return out;
}

Speeds hover_guess() {
  Speeds s;
  s.fill(939.0);
  return s;
}

struct Worst {
  double thrust_share = 0.0, tilt_torque_N_m = 0.0, yaw_torque_N_m = 0.0;
  int rounds = 0;
};
// Demands all over the envelope, met by speeds for `terms` and judged on `truth`.
Worst worst_of(const VehicleTerms& terms, const Truth& truth) {
  const Mixer mixer(kVehicle, {});
  const EffectFeedForward effects(kVehicle, terms, mixer.config());
  const RandomStream r(7, 1);
  Worst worst;
  for (std::uint64_t k = 0; k < 500; ++k) {
    const auto u = [&](std::uint64_t j) { return 2.0 * r.uniform(20 * k + j) - 1.0; };
    const MixerDemand d{8.0 + 2.0 * u(0), V3(0.05 * u(1), 0.05 * u(2), 0.015 * u(3)), V3(8 * u(4), 8 * u(5), 3 * u(6)),
                        V3(4 * u(7), 4 * u(8), 4 * u(9))};
    const EffectMotion motion{.v_B_m_s = d.v_B_m_s, .w_B_rad_s = d.w_B_rad_s};
    const EffectLoad start = effects.load(mixer, motion, hover_guess());
    const auto mixed = effects.solve(mixer, d, motion, start, hover_guess());
    EXPECT_FALSE(mixed.result.yaw_limited || mixed.result.thrust_limited || mixed.result.torque_limited);
    EXPECT_TRUE(mixed.converged);
    const Wrench w = produced(truth, mixed.result.omega_rad_s, d.v_B_m_s, d.w_B_rad_s);
    worst.thrust_share = std::max(worst.thrust_share, std::fabs(w.thrust_N / d.thrust_N - 1.0));
    const V3 off = w.torque_N_m - d.torque_B_N_m;
    worst.tilt_torque_N_m = std::max({worst.tilt_torque_N_m, std::fabs(off.x()), std::fabs(off.y())});
    worst.yaw_torque_N_m = std::max(worst.yaw_torque_N_m, std::fabs(off.z()));
    worst.rounds = std::max(worst.rounds, mixed.rounds);
  }
  return worst;
}

void expect_delivered(const Worst& w) {
  EXPECT_LT(w.thrust_share, 5e-4);
  EXPECT_LT(w.tilt_torque_N_m, 2e-4);
  EXPECT_LT(w.yaw_torque_N_m, 5e-5);
}

TEST(EffectMixing, ThrustThatGrowsWithSpeedIsInvertedTo0p05Percent) {
  expect_delivered(worst_of(test::terms_with(test::kThrustGrowth, {0.2}), {.growth = 0.2}));
}

TEST(EffectMixing, ARotor25PercentWeakerTurnsFasterAndNoTorqueIsLeft) {
  expect_delivered(worst_of(test::terms_with(test::kWeakThird, {-0.25}), {.weak_third = -0.25}));
}

TEST(EffectMixing, DownwashOnTheRearRotorsIsInvertedAtEightMetresPerSecond) {
  expect_delivered(worst_of(test::terms_with(test::kRearDownwash, {0.15}), {.downwash = 0.15}));
}

TEST(EffectMixing, TorqueOfTheBodyIsTakenOffTheDemand) {
  expect_delivered(worst_of(test::terms_with(test::kPush, {0.0, 0.03}), {.twist_N_m = 0.03}));
}

TEST(EffectMixing, SeveralEffectsAtOnceWithinFourRounds) {
  VehicleTerms terms = test::terms_with(test::kThrustGrowth, {0.15});
  test::add(terms, test::kWeakThird, {-0.1});
  test::add(terms, test::kRearDownwash, {0.1});
  test::add(terms, test::kPush, {0.0, -0.01});
  const Worst w = worst_of(terms, {.growth = 0.15, .weak_third = -0.1, .downwash = 0.1, .twist_N_m = -0.01});
  expect_delivered(w);
  EXPECT_LE(w.rounds, 4);
}

// The ablation: what the mixer alone makes of the same vehicle.
TEST(EffectMixing, WithoutTheTermThe25PercentRotorLeaves30MillinewtonmetresOfTilt) {
  const Worst w = worst_of(test::terms_with(test::kWeakThird, {0.0}), {.weak_third = -0.25});
  EXPECT_GT(w.tilt_torque_N_m, 0.03);
  EXPECT_GT(w.thrust_share, 0.04);
}

TEST(EffectMixing, TermsAtTheirNeutralValuesMoveNoSpeedByMoreThanTheTableDoes) {
  const Mixer mixer(kVehicle, {});
  VehicleTerms neutral = test::terms_with(test::kThrustGrowth, {0.0});
  test::add(neutral, test::kThrustScale, {1.0});
  test::add(neutral, test::kRearDownwash, {0.0});
  const EffectFeedForward effects(kVehicle, neutral, mixer.config());
  const MixerDemand d{8.0, V3(0.02, -0.03, 0.004), V3(7, -2, 1), V3(2, -1, 3)};
  const EffectMotion motion{.v_B_m_s = d.v_B_m_s, .w_B_rad_s = d.w_B_rad_s};
  const EffectLoad load = effects.load(mixer, motion, hover_guess());
  EXPECT_LT(load.force_B_N.norm(), 5e-3);
  EXPECT_LT(std::fabs(load.thrust_N), 1e-3 * 8.0);  // interpolation of the table
  const auto with = effects.solve(mixer, d, motion, load, hover_guess()).result.omega_rad_s;
  const auto without = mixer.solve(d, hover_guess()).omega_rad_s;
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(with[i], without[i], 0.6);
}

// ---- in the controller ------------------------------------------------------------------------------------

ControllerConfig config(const VehicleTerms& terms, Variant variant = Variant::pd_ff_thrust_drag) {
  ControllerConfig c = controller_config(read_gains(kRoot + "/vehicles/gains.toml"), variant);
  c.terms = terms;
  return c;
}
StateEstimate at_rest() {
  StateEstimate e;
  e.p_W_m = {0, 0, 2};
  e.valid = true;
  return e;
}
Setpoint hover() {
  Setpoint s;
  s.p_W_m = {0, 0, 2};
  return s;
}
struct Stepped {
  Command command;
  ControllerCounters counters;
};
Stepped step(const ControllerConfig& c, const StateEstimate& e) {
  ControllerState state;
  Stepped out;
  out.command = Controller(kVehicle, c).step(state, e, hover());
  out.counters = state.counters;
  return out;
}

TEST(EffectController, LeansAgainstAForceAcrossAndCountersItsTorque) {
  const Stepped s = step(config(test::terms_with(test::kPush, {0.8, 0.02})), at_rest());
  EXPECT_NEAR(s.command.diagnostics.thrust_W_N.x(), -0.8, 1e-9);
  EXPECT_NEAR(s.command.diagnostics.thrust_W_N.z(), kWeight_N, 1e-9);
  EXPECT_EQ(s.counters.effects_bounded + s.counters.effects_not_finite + s.counters.effects_off, 0u);
}

TEST(EffectController, TheVariantWithoutEffectsAndAVehicleWithoutTermsFlyTheSameSpeeds) {
  StateEstimate fast = at_rest();
  fast.v_W_m_s = {6, -2, 1};
  const Stepped off = step(config(test::terms_with(test::kPush, {0.8, 0.02}), Variant::pd_ff_no_effects), fast);
  const Stepped none = step(config({}), fast);
  EXPECT_EQ(off.command.omega_rad_s, none.command.omega_rad_s);
  EXPECT_EQ(off.command.diagnostics.effect_rounds, 0);
  EXPECT_NE(step(config(test::terms_with(test::kPush, {0.8, 0.02})), fast).command.omega_rad_s, none.command.omega_rad_s);
}

TEST(EffectController, ATermThatGivesNoNumberIsCountedAndEquationsOneToFiveFly) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  const Stepped plain = step(config({}), at_rest());
  for (const double bad : {nan, infinite}) {
    const Stepped s = step(config(test::terms_with(test::kPush, {bad, 0.0})), at_rest());
    EXPECT_EQ(s.counters.effects_not_finite, 1u);
    EXPECT_EQ(s.command.omega_rad_s, plain.command.omega_rad_s);
  }
}

TEST(EffectController, ATermThatAsksForHundredNewtonIsCutToHalfTheWeight) {
  const Stepped s = step(config(test::terms_with(test::kPush, {100.0, 50.0})), at_rest());
  EXPECT_EQ(s.counters.effects_bounded, 1u);
  EXPECT_NEAR(s.command.diagnostics.thrust_W_N.x(), -0.5 * kWeight_N, 1e-9);
}

TEST(EffectController, AThirdOfTheThrustIsCorrectedNoFurtherThanHalfTheWeight) {
  const Stepped s = step(config(test::terms_with(test::kThrustScale, {0.3})), at_rest());
  EXPECT_GT(s.counters.effects_bounded, 0u);
  EXPECT_LE(s.command.diagnostics.effect_thrust_N, 0.5 * kWeight_N + 1e-9);
}

TEST(EffectController, WithoutAValidEstimateTermsAreOffAndCounted) {
  StateEstimate lost = at_rest();
  lost.valid = false;
  const Stepped s = step(config(test::terms_with(test::kPush, {0.8, 0.02})), lost);
  EXPECT_EQ(s.counters.effects_off, 1u);
  EXPECT_EQ(s.command.omega_rad_s, step(config({}), lost).command.omega_rad_s);
}

TEST(EffectController, AnyInputUnderAnyTermGivesSpeedsWithinTheLimits) {
  VehicleTerms wild = test::terms_with(test::kThrustGrowth, {1.0});
  test::add(wild, test::kWeakThird, {-0.5});
  test::add(wild, test::kRearDownwash, {1.0});
  test::add(wild, test::kPush, {-30.0, 3.0});
  const ControllerConfig c = config(wild);
  const Controller controller(kVehicle, c);
  ControllerState state;
  const RandomStream r(11, 3);
  for (std::uint64_t k = 0; k < 3000; ++k) {
    const auto u = [&](std::uint64_t j) { return 2.0 * r.uniform(32 * k + j) - 1.0; };
    const double size = std::pow(10.0, 3.0 * u(0));
    StateEstimate e;
    e.valid = u(1) > -0.9;
    e.p_W_m = size * V3(u(2), u(3), u(4));
    e.v_W_m_s = size * V3(u(5), u(6), u(7));
    e.w_B_rad_s = size * V3(u(8), u(9), u(10));
    e.q_WB = Eigen::Quaterniond(u(11), u(12), u(13), u(14)).normalized();
    const Command command = controller.step(state, e, hover());
    for (const double w : command.omega_rad_s) {
      ASSERT_GE(w, c.omega_min_rad_s - 1e-9);
      ASSERT_LE(w, c.omega_max_rad_s + 1e-9);
    }
  }
}

// ---- flown ------------------------------------------------------------------------------------------------

const Trajectory& vertical() {
  static const Trajectory t = read_trajectory(kRoot + "/scenarios/trajectories/vertical_3p1.toml").trajectory;
  return t;
}
double vertical_error_m(double plant_scale, const VehicleTerms& terms) {
  test::FlightSetup s;
  s.model = kVehicle;
  s.controller = config(terms);
  s.plant.thrust_scale = plant_scale;
  const test::FlightFigures f = fly(s, vertical());
  EXPECT_EQ(f.controller.effects_not_converged + f.controller.effects_bounded + f.controller.effects_not_finite, 0u);
  return f.mean_error_z_m;
}

TEST(EffectFlight, EightPercentLessThrustCostsNothingOnceTheVehicleFileSaysSo) {
  const double told = vertical_error_m(0.92, test::terms_with(test::kThrustScale, {0.92}));
  EXPECT_GT(vertical_error_m(0.92, {}), 0.03);
  EXPECT_LT(told, 0.012);
  EXPECT_NEAR(told, vertical_error_m(1.0, {}), 0.002);
}

TEST(EffectFlight, AnEstimateThatIsAThirdOffStillHelps) {
  const double without = vertical_error_m(0.92, {});
  EXPECT_LT(vertical_error_m(0.92, test::terms_with(test::kThrustScale, {0.947})), 0.55 * without);
  EXPECT_LT(vertical_error_m(0.92, test::terms_with(test::kThrustScale, {0.893})), 0.55 * without);
}

}  // namespace
}  // namespace rotorloop::host
