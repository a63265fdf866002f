// Faults of a drive: each shows what it does in hardware, from its instant on, and goes with it.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/drive/typical.hpp"

namespace {

using namespace rotorloop::sim;
using rotorloop::RandomStream;

const PwmCommand kVector{{1100, 760, 850}, 1771, true};

Drive drive_with(const DriveFault& fault) {
  DriveParameters p = typical_drive({}, 45.0, RandomStream(5, 1)).drive;
  p.sensing.noise_counts = p.sensing.bus_noise_counts = 0.0;
  p.sensing.bad_sample_every = 0.0;
  p.faults = {fault};
  Drive d(p, RandomStream(1, 1));
  d.set_bus_V(15.0);
  return d;
}

void run_ms(Drive& d, int ms, const PwmCommand& pwm = kVector) {
  for (int k = 0; k < 48 * ms; ++k) d.step(pwm);
}

TEST(DriveFault, OpenPhaseCarriesNoCurrentAndTheOthersBecomeOneLoop) {
  Drive d = drive_with({.kind = DriveFaultKind::phase_open, .phase = 1, .from_s = 0.003});
  run_ms(d, 2);
  EXPECT_GT(std::fabs(d.phase_currents_A().v), 1.0);
  run_ms(d, 3);
  EXPECT_NEAR(d.phase_currents_A().v, 0.0, 0.05);
  EXPECT_NEAR(d.phase_currents_A().u, -d.phase_currents_A().w, 0.05);
  EXPECT_GT(std::fabs(d.phase_currents_A().u), 1.0);
}

TEST(DriveFault, ShortedShuntReadsZeroAmperesWhileTheCurrentFlows) {
  Drive d = drive_with({.kind = DriveFaultKind::shunt_short, .phase = 0, .from_s = 0.0});
  run_ms(d, 2);
  EXPECT_GT(std::fabs(d.phase_currents_A().u), 5.0);
  EXPECT_NEAR(d.sample().phase[0], 2553, 1);
}

TEST(DriveFault, OpenShuntSendsItsAmplifierToTheRail) {
  Drive d = drive_with({.kind = DriveFaultKind::shunt_open, .phase = 2, .from_s = 0.0});
  run_ms(d, 2);
  EXPECT_EQ(d.sample().phase[2], 4095);
}

TEST(DriveFault, OpenHighFetGivesItsPhaseNoPositiveCurrent) {
  Drive d = drive_with({.kind = DriveFaultKind::high_fet_open, .phase = 0, .from_s = 0.0});
  run_ms(d, 5);
  EXPECT_LT(d.phase_currents_A().u, 0.5);
}

TEST(DriveFault, ShortedLowFetAgainstASwitchingHighSideDrawsMoreThanAnyFuseAllows) {
  Drive d = drive_with({.kind = DriveFaultKind::low_fet_short, .phase = 0, .from_s = 0.0});
  run_ms(d, 2);
  const double before_J = d.bus_energy_J();
  run_ms(d, 1);
  EXPECT_GT((d.bus_energy_J() - before_J) / 1e-3 / 15.0, 200.0);  // A
}

TEST(DriveFault, ThermistorOpenAndShortReadTheTwoRails) {
  Drive open = drive_with({.kind = DriveFaultKind::ntc_open}), shorted = drive_with({.kind = DriveFaultKind::ntc_short});
  run_ms(open, 2);
  run_ms(shorted, 2);
  EXPECT_EQ(open.sample().temperature, 0);
  EXPECT_EQ(shorted.sample().temperature, 4095);
}

TEST(DriveFault, WeakMagnetsLoseTheirShareOfTorqueAndBackEmf) {
  Drive d = drive_with({.kind = DriveFaultKind::weak_magnets, .from_s = 0.0, .size = 0.8});
  Drive whole = drive_with({.kind = DriveFaultKind::weak_magnets, .from_s = 0.0, .size = 1.0});
  run_ms(d, 2);
  run_ms(whole, 2);
  // Generating with the bridge shorted: current is EMF over impedance.
  for (Drive* x : {&d, &whole}) {
    x->motor().state().omega_rad_s = 600.0;
    run_ms(*x, 4, {{0, 0, 0}, 1771, true});
  }
  EXPECT_NEAR(d.omega_rad_s() / whole.omega_rad_s(), 1.0, 0.2);
  const auto a = [](const Drive& x) { return std::hypot(x.motor().state().i_d_A, x.motor().state().i_q_A) / x.omega_rad_s(); };
  EXPECT_NEAR(a(d) / a(whole), 0.8, 0.06);
}

TEST(DriveFault, LockedRotorStandsAndIsFreeAgainAfterwards) {
  Drive d = drive_with({.kind = DriveFaultKind::rotor_lock, .from_s = 0.01, .until_s = 0.02});
  d.motor().state().omega_rad_s = 900.0;
  run_ms(d, 9, {});
  EXPECT_GT(d.omega_rad_s(), 800.0);
  run_ms(d, 4, {});
  EXPECT_NEAR(d.omega_rad_s(), 0.0, 1e-3);
  run_ms(d, 17, kVector);
  EXPECT_GT(std::fabs(d.motor().state().angle_rad), 0.01);
}

TEST(DriveFault, PropellerThatStrikesSlowsByItsTorqueAndALostOneLeavesTheBellAlone) {
  Drive strike = drive_with({.kind = DriveFaultKind::prop_strike, .from_s = 0.0, .until_s = 1.0, .size = 0.1});
  strike.motor().state().omega_rad_s = 1500.0;
  run_ms(strike, 1, {});
  const double w = strike.omega_rad_s();
  run_ms(strike, 20, {});
  EXPECT_NEAR(w - strike.omega_rad_s(), (0.1 + 2e-3) / 9.4e-6 * 0.020, 10.0);
  Drive lost = drive_with({.kind = DriveFaultKind::prop_loss, .from_s = 0.0});
  lost.set_load({2.9e-8, 0.0});
  lost.motor().state().omega_rad_s = 1500.0;
  run_ms(lost, 1, {});
  const double before = lost.omega_rad_s();
  run_ms(lost, 100, {});
  EXPECT_NEAR(before - lost.omega_rad_s(), 2e-3 / 5.0e-6 * 0.1, 3.0);  // dry friction alone, bell alone
}

}  // namespace
