// One step of the controller: eq. (9) term by term, the variants, the limits, and that nothing fed to it makes it unsafe.
#include "host/control/controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "host/base/random.hpp"
#include "host/control/gains_file.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"

namespace rotorloop::host {
namespace {

using V3 = Eigen::Vector3d;

const VehicleModel kVehicle = test::paper_vehicle();
const double kWeight_N = 0.682 * 9.80665;

ControllerConfig config(Variant variant = Variant::pd_ff_thrust_drag) {
  return controller_config(read_gains(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/gains.toml"), variant);
}

StateEstimate at_rest() {
  StateEstimate e;
  e.p_W_m = {0, 0, 2};
  e.valid = true;
  return e;
}
Setpoint hover_at(V3 p) {
  Setpoint s;
  s.p_W_m = p;
  return s;
}
Command once(const ControllerConfig& c, const StateEstimate& e, const Setpoint& s) {
  ControllerState state;
  return Controller(kVehicle, c).step(state, e, s);
}

TEST(Controller, HoverOnTheSpotIsWeightWithoutTorqueAt8950Rpm) {
  const Command c = once(config(), at_rest(), hover_at({0, 0, 2}));
  EXPECT_NEAR(c.diagnostics.thrust_B_N, kWeight_N, 1e-9);
  EXPECT_LT(c.diagnostics.torque_B_N_m.norm(), 1e-12);
  double mean = 0;
  for (const double w : c.omega_rad_s) mean += 0.25 * w * 60.0 / (2.0 * M_PI);
  EXPECT_NEAR(mean, 8960.0, 20.0);
  EXPECT_EQ(c.diagnostics.limiters, Limiters{});
}

TEST(Controller, EquationNineTermByTerm) {
  const ControllerConfig c = config(Variant::pd_ff);
  const double m = 0.682, wh = c.gains.horizontal.frequency_rad_s, wv = c.gains.vertical.frequency_rad_s;
  EXPECT_NEAR(once(c, at_rest(), hover_at({0.1, 0, 2})).diagnostics.thrust_W_N.x(), m * wh * wh * 0.1, 1e-9);
  EXPECT_NEAR(once(c, at_rest(), hover_at({0, 0, 2.1})).diagnostics.thrust_W_N.z(), kWeight_N + m * wv * wv * 0.1, 1e-9);
  StateEstimate moving = at_rest();
  moving.v_W_m_s = {0, 0.2, 0};
  EXPECT_NEAR(once(c, moving, hover_at({0, 0, 2})).diagnostics.thrust_W_N.y(), -m * 2 * c.gains.horizontal.damping * wh * 0.2, 1e-9);
  Setpoint accelerating = hover_at({0, 0, 2});
  accelerating.a_W_m_s2 = {3, 0, 1};
  EXPECT_LT((once(c, at_rest(), accelerating).diagnostics.thrust_W_N - V3(m * 3, 0, kWeight_N + m * 1)).norm(), 1e-9);
}

TEST(Controller, DragCompensationAt8p5IsTheDragAndOnlyInItsVariants) {
  StateEstimate fast = at_rest();
  fast.v_W_m_s = {8.5, 0, 0};
  Setpoint s = hover_at({0, 0, 2});
  s.v_W_m_s = fast.v_W_m_s;
  const double none = once(config(Variant::pd_ff), fast, s).diagnostics.thrust_W_N.x();
  const double drag = once(config(Variant::pd_ff_drag), fast, s).diagnostics.thrust_W_N.x();
  const double both = once(config(Variant::pd_ff_thrust_drag), fast, s).diagnostics.thrust_W_N.x();
  EXPECT_NEAR(none, 0.0, 1e-9);
  EXPECT_NEAR(drag, kWeight_N * 0.0175 * 8.5 + 0.0055 * 8.5 * 8.5, 1e-9);
  EXPECT_EQ(drag, both);
}

TEST(Controller, OnlyTheThrustVariantSpinsUpForAClimb) {
  StateEstimate climbing = at_rest();
  climbing.v_W_m_s = {0, 0, 3.1};
  Setpoint s = hover_at({0, 0, 2});
  s.v_W_m_s = climbing.v_W_m_s;
  const double still = once(config(Variant::pd_ff_drag), climbing, s).omega_rad_s[0];
  const double solved = once(config(Variant::pd_ff_thrust_drag), climbing, s).omega_rad_s[0];
  EXPECT_NEAR(solved / still, 1.06, 0.015);  // 11 % less c_t
}

TEST(Controller, TorqueTurnsTheBodyTowardsTheSetpoint) {
  StateEstimate rolled = at_rest();
  rolled.q_WB = Eigen::AngleAxisd(0.1, V3::UnitX());
  EXPECT_LT(once(config(), rolled, hover_at({0, 0, 2})).diagnostics.torque_B_N_m.x(), 0.0);
  StateEstimate spinning = at_rest();
  spinning.w_B_rad_s = {0, 0.5, 0};
  EXPECT_LT(once(config(), spinning, hover_at({0, 0, 2})).diagnostics.torque_B_N_m.y(), 0.0);
}

TEST(Controller, FarAwayItTiltsToTheLimitAndKeepsHeight) {
  const Command c = once(config(), at_rest(), hover_at({100, 0, 2}));
  EXPECT_TRUE(c.diagnostics.limiters.tilt);
  EXPECT_NEAR(std::atan2(c.diagnostics.thrust_W_N.x(), c.diagnostics.thrust_W_N.z()), 65.0 * M_PI / 180.0, 1e-6);
  EXPECT_NEAR(c.diagnostics.thrust_W_N.z(), kWeight_N, 1e-6);
  const Command falling = once(config(), at_rest(), hover_at({0, 0, -100}));
  EXPECT_TRUE(falling.diagnostics.limiters.thrust);
  EXPECT_NEAR(falling.diagnostics.thrust_W_N.z(), 0.2 * kWeight_N, 1e-9);
}

TEST(Controller, UpsideDownItAsksForNoThrustButFullTorque) {
  StateEstimate e = at_rest();
  e.q_WB = Eigen::AngleAxisd(3.1, V3::UnitX());
  const Command c = once(config(), e, hover_at({0, 0, 2}));
  EXPECT_EQ(c.diagnostics.thrust_B_N, 0.0);
  EXPECT_GT(std::fabs(c.diagnostics.torque_B_N_m.x()), 0.5);
}

TEST(Controller, InvalidEstimateMeansLevelAtTheWeightAndIsCounted) {
  StateEstimate lost = at_rest();
  lost.valid = false;
  lost.p_W_m = {50, -20, 7};
  lost.v_W_m_s = {9, 9, 9};
  ControllerState state;
  const Command c = Controller(kVehicle, config()).step(state, lost, hover_at({0, 0, 2}));
  EXPECT_TRUE(c.diagnostics.estimate_invalid);
  EXPECT_EQ(state.counters.estimate_invalid, 1u);
  EXPECT_LT((c.diagnostics.thrust_W_N - V3(0, 0, kWeight_N)).norm(), 1e-9);
  lost.valid = true;  // without the flag the same numbers would throw it across the room
  EXPECT_TRUE(once(config(), lost, hover_at({0, 0, 2})).diagnostics.limiters.tilt);
}

TEST(Controller, AnyInputGivesSpeedsWithinTheLimits) {
  const Controller controller(kVehicle, config());
  ControllerState state;
  const RandomStream r(9, 1);
  const std::array<double, 8> poison{std::numeric_limits<double>::quiet_NaN(),
                                     std::numeric_limits<double>::infinity(),
                                     -std::numeric_limits<double>::infinity(),
                                     1e300,
                                     -1e300,
                                     1e9,
                                     5e-324,
                                     0.0};
  std::uint64_t expected_bad = 0;
  for (std::uint64_t k = 0; k < 20000; ++k) {
    std::uint64_t n = 64 * k;
    const auto number = [&](double scale) {
      const double u = r.uniform(n++);
      return u < 0.01 ? poison[static_cast<std::size_t>(u * 800.0)] : scale * (2.0 * r.uniform(n++) - 1.0);
    };
    const auto vector = [&](double scale) { return V3(number(scale), number(scale), number(scale)); };
    StateEstimate e;
    e.p_W_m = vector(20);
    e.v_W_m_s = vector(15);
    e.w_B_rad_s = vector(20);
    e.q_WB.coeffs() << number(1), number(1), number(1), number(1);
    if (r.uniform(n++) < 0.9) e.q_WB.normalize();
    e.valid = r.uniform(n++) < 0.8;
    Setpoint s;
    s.p_W_m = vector(20);
    s.v_W_m_s = vector(15);
    s.a_W_m_s2 = vector(30);
    s.j_W_m_s3 = vector(200);
    s.yaw_rad = number(10);
    s.yaw_rate_rad_s = number(10);
    const std::array<double, 4> before = state.omega_rad_s;
    const bool started = state.started;
    const Command c = controller.step(state, e, s);
    for (std::size_t i = 0; i < 4; ++i) {
      ASSERT_GE(c.omega_rad_s[i], 250.0 - 1e-9) << k;
      ASSERT_LE(c.omega_rad_s[i], 1780.2 + 1e-9) << k;
      if (c.diagnostics.bad_input && started) {
        ASSERT_EQ(c.omega_rad_s[i], before[i]);
      }
    }
    expected_bad += c.diagnostics.bad_input;
  }
  EXPECT_EQ(state.counters.bad_input, expected_bad);
  EXPECT_GT(expected_bad, 1000u);
  EXPECT_LT(expected_bad, 15000u);
  EXPECT_EQ(state.counters.steps, 20000u);
}

TEST(Controller, BadInputBeforeTheFirstGoodStepGivesHoverSpeeds) {
  StateEstimate e = at_rest();
  e.p_W_m.x() = std::numeric_limits<double>::quiet_NaN();
  const Command c = once(config(), e, hover_at({0, 0, 2}));
  EXPECT_TRUE(c.diagnostics.bad_input);
  for (const double w : c.omega_rad_s) EXPECT_NEAR(w, 938.8, 2.0);
}

TEST(Controller, StepDependsOnItsArgumentsAlone) {
  const Controller controller(kVehicle, config());
  ControllerState a, b;
  StateEstimate e = at_rest();
  e.v_W_m_s = {3, 1, -0.5};
  Setpoint s = hover_at({0.2, 0.1, 2.1});
  controller.step(a, at_rest(), s);
  b = a;
  EXPECT_EQ(controller.step(a, e, s).omega_rad_s, controller.step(b, e, s).omega_rad_s);
}

TEST(Variant, NamesReadBack) {
  for (const Variant v : {Variant::pd_ff, Variant::pd_ff_drag, Variant::pd_ff_thrust_drag}) {
    Variant back{};
    EXPECT_TRUE(parse(name(v), back));
    EXPECT_EQ(back, v);
  }
  Variant untouched = Variant::pd_ff_drag;
  EXPECT_FALSE(parse("pid", untouched));
  EXPECT_EQ(untouched, Variant::pd_ff_drag);
}

}  // namespace
}  // namespace rotorloop::host
