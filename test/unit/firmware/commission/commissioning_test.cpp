// The commissioning against a true drive: what it finds, and that nothing but a fresh order drives the motor.
#include <gtest/gtest.h>

#include "bench/hil/esc_lab/commissioning_rig.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::firmware;
using Rig = esc_lab::CommissioningRig<FakeBoard>;

// The reference motor, its inductances apart, on an ideal board but for dead time and noise.
sim::DriveParameters true_motor() {
  sim::DriveParameters d;
  d.motor.resistance_ohm = 0.066;
  d.motor.inductance_H = {.d = 13e-6, .q = 16e-6};
  d.motor.flux_linkage_Wb = 3.1e-4;
  d.inverter.dead_time_s = 650e-9;
  d.inverter.node_capacitance_F = 4e-9;
  return d;
}
constexpr double kLoad_N_m_s2 = 2.9e-8, kBus_V = 15.0;

Rig rig(CommissioningTask task) {
  Rig r(true_motor(), Parameters{}, kBus_V, kLoad_N_m_s2, 3);
  r.order.task = task;
  return r;
}

TEST(Commissioning, FindsResistanceInductancesAndDeadTimeAtRestWithinTwoPercentAndSpinsNothing) {
  Rig r = rig(CommissioningTask::standstill);
  const CommissioningResult found = r.run_until();
  ASSERT_EQ(found.end, CommissioningEnd::done);
  EXPECT_TRUE(found.standstill_valid);
  EXPECT_FALSE(found.spin_valid);
  EXPECT_NEAR(found.resistance_ohm, 0.070, 0.02 * 0.070);
  EXPECT_NEAR(found.inductance_d_H, 13e-6, 0.02 * 13e-6);
  EXPECT_NEAR(found.inductance_q_H, 16e-6, 0.02 * 16e-6);
  EXPECT_NEAR(found.dead_time_s, 650e-9, 20e-9);
  EXPECT_FALSE(r.board().bridge);
  EXPECT_LT(r.peak_A, 20.0);
  EXPECT_LT(r.peak_rad_s, 120.0);  // the swings of the alignment
}

TEST(Commissioning, FindsFluxInertiaAndThePropellersTorqueBySpinning) {
  Rig r = rig(CommissioningTask::all);
  r.order.speed_constant_rpm_V = 2540.0f;
  r.order.bell_inertia_kg_m2 = 5e-6f;
  const CommissioningResult found = r.run_until();
  ASSERT_EQ(found.end, CommissioningEnd::done);
  EXPECT_TRUE(found.spin_valid);
  EXPECT_NEAR(found.flux_linkage_Wb, 3.1e-4, 0.02 * 3.1e-4);
  EXPECT_NEAR(found.inertia_kg_m2, 9.4e-6, 0.04 * 9.4e-6);
  EXPECT_NEAR(found.load_N_m_s2, kLoad_N_m_s2, 0.1 * kLoad_N_m_s2);
  EXPECT_EQ(found.pole_pairs, 0);  // nobody counted: not measured
  EXPECT_EQ(found.direction, SeenDirection::not_seen);
  EXPECT_FALSE(r.board().bridge);
}

TEST(Commissioning, HoldsTheSpeedUntilItWasCountedAndTakesThePolePairsFromTheCount) {
  Rig r = rig(CommissioningTask::all);
  r.order.wait_for_reference = true;
  ASSERT_EQ(r.run_until(CommissioningPhase::speed_held).phase, CommissioningPhase::speed_held);
  r.run_s(2.0);
  ASSERT_EQ(r.result().phase, CommissioningPhase::speed_held);
  r.order.counted_rad_s = static_cast<float>(r.drive().omega_rad_s());
  r.order.direction = SeenDirection::reversed;
  const CommissioningResult found = r.run_until();
  EXPECT_EQ(found.end, CommissioningEnd::done);
  EXPECT_EQ(found.pole_pairs, 7);
  EXPECT_EQ(found.direction, SeenDirection::reversed);
}

TEST(Commissioning, RefusesACountThatIsNoWholeNumberOfPolePairs) {
  Rig r = rig(CommissioningTask::all);
  r.order.wait_for_reference = true;
  r.run_until(CommissioningPhase::speed_held);
  r.run_s(0.4);
  r.order.counted_rad_s = static_cast<float>(r.drive().omega_rad_s() * 7.0 / 6.5);
  EXPECT_EQ(r.run_until().end, CommissioningEnd::counted_speed_inconsistent);
  EXPECT_FALSE(r.board().bridge);
}

TEST(Commissioning, AKeepAliveThatStopsOpensTheBridgeWithinTwentyOneMillisecondsInEveryPhase) {
  using enum CommissioningPhase;
  for (const CommissioningPhase phase :
       {guess, align, resistance, inductance_d, inductance_q, spin_align, ramp, speed_held, accelerate, coast}) {
    Rig r = rig(CommissioningTask::all);
    ASSERT_EQ(r.run_until(phase).phase, phase);
    r.run_s(0.001);
    r.run_s(0.021, false);
    EXPECT_FALSE(r.board().bridge) << static_cast<int>(phase);
    EXPECT_EQ(r.result().end, CommissioningEnd::order_expired) << static_cast<int>(phase);
    EXPECT_FALSE(r.result().spin_valid);
  }
}

TEST(Commissioning, EndsAtOnceWithAnOrderOffAndBeginsAgainOnlyAfterOne) {
  Rig r = rig(CommissioningTask::all);
  r.run_until(CommissioningPhase::resistance);
  r.order.task = CommissioningTask::off;
  r.run_s(0.001);
  EXPECT_FALSE(r.board().bridge);
  EXPECT_EQ(r.result().end, CommissioningEnd::cancelled);

  Rig again = rig(CommissioningTask::standstill);
  ASSERT_EQ(again.run_until().end, CommissioningEnd::done);
  again.run_s(0.5);  // the order still stands
  EXPECT_EQ(again.result().number, 1u);
  EXPECT_FALSE(again.commissioning().active());
  again.order.task = CommissioningTask::off;
  again.run_s(0.01);
  again.order.task = CommissioningTask::standstill;
  again.run_s(0.1);
  EXPECT_EQ(again.result().number, 2u);
  EXPECT_TRUE(again.board().bridge);
}

TEST(Commissioning, DrivesNothingWithoutAnOrder) {
  Rig r = rig(CommissioningTask::all);
  r.run_s(1.0, false);
  EXPECT_FALSE(r.board().bridge);
  EXPECT_EQ(r.result().number, 0u);
}

TEST(Commissioning, AProtectionEndsItWithItsName) {
  Rig low = rig(CommissioningTask::standstill);
  low.run_until(CommissioningPhase::resistance);
  low.drive().set_bus_V(10.0);
  low.run_s(0.02);
  EXPECT_EQ(low.result().end, CommissioningEnd::undervoltage);
  EXPECT_FALSE(low.board().bridge);

  Rig high = rig(CommissioningTask::standstill);
  high.run_until(CommissioningPhase::resistance);
  high.drive().set_bus_V(30.0);
  high.run_s(0.02);
  EXPECT_EQ(high.result().end, CommissioningEnd::overvoltage);

  sim::DriveParameters open = true_motor();
  open.faults.push_back({.kind = sim::DriveFaultKind::phase_open, .phase = 0});
  Rig broken(open, Parameters{}, kBus_V, kLoad_N_m_s2, 3);
  broken.order.task = CommissioningTask::standstill;
  EXPECT_EQ(broken.run_until().end, CommissioningEnd::no_current);
  EXPECT_FALSE(broken.board().bridge);
}

TEST(Commissioning, RefusesWrongPolePairsByTheSpeedConstantAndAHeldRotorByName) {
  Parameters entered;
  entered.pole_pairs = 5;
  Rig wrong(true_motor(), entered, kBus_V, kLoad_N_m_s2, 3);
  wrong.order.task = CommissioningTask::all;
  wrong.order.speed_constant_rpm_V = 2540.0f;
  EXPECT_EQ(wrong.run_until().end, CommissioningEnd::speed_constant_differs);

  sim::DriveParameters held = true_motor();
  held.faults.push_back({.kind = sim::DriveFaultKind::rotor_lock, .from_s = 5.0});
  Rig locked(held, Parameters{}, kBus_V, kLoad_N_m_s2, 3);
  locked.order.task = CommissioningTask::all;
  EXPECT_EQ(locked.run_until().end, CommissioningEnd::does_not_turn);
  EXPECT_FALSE(locked.board().bridge);
}

}  // namespace
