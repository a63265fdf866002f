// The averaged six-step drive against closed forms, the power balance, and a bridge whose every phase and diode is stepped.
#include "sim/drive/six_step.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace {

using namespace rotorloop::sim;

constexpr double kRpm = std::numbers::pi / 30.0;

SixStepParameters motor() {
  return {.emf_constant_V_s = six_step_emf_constant_V_s(1800.0),
          .resistance_ohm = 0.08,
          .phase_inductance_H = 7e-6,
          .pole_pairs = 7,
          .static_friction_N_m = 4e-3,
          .viscous_friction_N_m_s = 3e-6,
          .switching_time_s = 100e-9,
          .pwm_Hz = 24e3};
}
SixStepParameters ideal() {
  SixStepParameters p = motor();
  p.phase_inductance_H = p.static_friction_N_m = p.viscous_friction_N_m_s = p.switching_time_s = 0.0;
  return p;
}
double propeller(double omega_rad_s) { return 1.5e-8 * omega_rad_s * omega_rad_s; }
double nothing(double) { return 0.0; }

TEST(SixStepEmf, SinusoidalMeanIsThreeOverPiOfTheLinePeak) {
  const double flux_Wb = 3.42e-4;
  double sum = 0.0;
  constexpr int kSteps = 6000;
  for (int i = 0; i < kSteps; ++i)
    sum += std::cos((static_cast<double>(i) + 0.5) / kSteps * std::numbers::pi / 3.0 - std::numbers::pi / 6.0);
  EXPECT_NEAR(six_step_emf_constant_V_s(EmfShape::sinusoidal, flux_Wb, 7), std::sqrt(3.0) * 7 * flux_Wb * sum / kSteps, 1e-9);
}
TEST(SixStepEmf, FlatTrapezoidPutsTwoPhasesInSeries) {
  EXPECT_DOUBLE_EQ(six_step_emf_constant_V_s(EmfShape::trapezoidal, 3e-4, 7), 2 * 7 * 3e-4);
}
TEST(SixStepEmf, NoLoadRpmPerVoltIsTheMeanNotThePeak) {
  // The reference motor: 2300 rpm per volt of PEAK line EMF turns 2300 pi/3 rpm per volt of d V under six-step.
  const double k_e = six_step_emf_constant_V_s(EmfShape::sinusoidal, 60.0 / (std::sqrt(3.0) * 2.0 * std::numbers::pi * 2300.0 * 7), 7);
  EXPECT_NEAR(1.0 / (k_e * kRpm), 2300.0 * std::numbers::pi / 3.0, 1e-6);
}

TEST(SixStep, FreeIdealMotorTurnsKvTimesDutyTimesVoltage) {
  for (const double duty : {0.1, 0.5, 1.0})
    EXPECT_NEAR(six_step_steady(ideal(), 24.0, duty, nothing).omega_rad_s / kRpm, 1800.0 * 24.0 * duty, 1e-6);
}
TEST(SixStep, StalledMotorDrawsDutyVoltageOverResistance) {
  const SixStepPoint s = six_step_steady(motor(), 24.0, 0.05, [](double) { return 1.0; });
  EXPECT_EQ(s.omega_rad_s, 0.0);
  EXPECT_DOUBLE_EQ(s.current_A, 0.05 * 24.0 / 0.08);
  EXPECT_EQ(s.commutation_drop_V, 0.0);
}
TEST(SixStep, DryFrictionHoldsAShaftThatIsTooWeaklyDriven) {
  SixStepParameters p = motor();
  p.static_friction_N_m = 0.1;  // stall torque is 0.08 N m
  EXPECT_EQ(six_step_steady(p, 24.0, 0.05, nothing).omega_rad_s, 0.0);
}
TEST(SixStep, BusPowerIsShaftPowerPlusNamedLosses) {
  for (const double duty : {0.2, 0.6, 1.0}) {
    const SixStepPoint s = six_step_steady(motor(), 24.0, duty, propeller);
    const double shaft_W = (propeller(s.omega_rad_s) + s.friction_N_m) * s.omega_rad_s;
    EXPECT_NEAR(24.0 * s.bus_current_A, shaft_W + s.resistive_loss_W + s.switching_loss_W, 1e-6);
    EXPECT_GT(s.switching_loss_W, 0.0);
  }
}
TEST(SixStep, CommutationDropCostsSpeedButNoPower) {
  SixStepParameters without = motor();
  without.phase_inductance_H = 0.0;
  const SixStepPoint a = six_step_steady(motor(), 24.0, 1.0, propeller), b = six_step_steady(without, 24.0, 1.0, propeller);
  EXPECT_LT(a.omega_rad_s, 0.95 * b.omega_rad_s);
  EXPECT_NEAR(a.current_A * 0.08 + a.commutation_drop_V + motor().emf_constant_V_s * a.omega_rad_s, 24.0, 1e-9);
  EXPECT_LT(a.bus_current_A, a.current_A);  // at full duty too: the pair's current is not all drawn from the bus
}
TEST(SixStep, SpeedAndCurrentRiseWithDuty) {
  double speed = 0.0, current = 0.0;
  for (int k = 1; k <= 20; ++k) {
    const SixStepPoint s = six_step_steady(motor(), 24.0, 0.05 * k, propeller);
    EXPECT_GT(s.omega_rad_s, speed);
    EXPECT_GT(s.bus_current_A, current);
    speed = s.omega_rad_s;
    current = s.bus_current_A;
  }
}
TEST(SixStep, MotorTurnedFasterThanItsVoltageFeedsBack) {
  const SixStepPoint s = six_step_at(motor(), 24.0, 0.5, 1.3 * 0.5 * 24.0 * 1800.0 * kRpm);
  EXPECT_LT(s.current_A, 0.0);
  EXPECT_LT(s.bus_current_A, 0.0);
}
TEST(SixStep, DutyIsFoundFromSpeedAndCurrent) {
  const SixStepPoint s = six_step_steady(motor(), 24.0, 0.37, propeller);
  EXPECT_NEAR(six_step_duty(motor(), 24.0, s.omega_rad_s, s.current_A), 0.37, 1e-9);
}
TEST(SixStep, RunUpEndsAtTheSteadySpeed) {
  double omega = 0.0;
  for (int k = 0; k < 2000; ++k) omega = six_step_advance(motor(), 9.4e-6, 24.0, 0.6, propeller, omega, 5e-4);
  EXPECT_NEAR(omega, six_step_steady(motor(), 24.0, 0.6, propeller).omega_rad_s, 1e-6 * omega);
}
TEST(SixStep, RunUpHasTheTimeConstantOfAMotorWithoutInductance) {
  // Unloaded: omega(t) = omega_0 (1 - exp(-t / tau)), tau = J R / k_e^2.
  const SixStepParameters p = ideal();
  const double tau_s = 9.4e-6 * p.resistance_ohm / (p.emf_constant_V_s * p.emf_constant_V_s);
  double omega = 0.0;
  constexpr int kSteps = 1000;
  for (int k = 0; k < kSteps; ++k) omega = six_step_advance(p, 9.4e-6, 24.0, 0.5, nothing, omega, tau_s / kSteps);
  EXPECT_NEAR(omega / (0.5 * 24.0 / p.emf_constant_V_s), 1.0 - std::exp(-1.0), 1e-6);
}

// Three phases in a star, trapezoidal EMF flat over 120 degrees, PWM averaged: the switched high side stands at d V, the low side at
// 0, a phase that leaves hangs on the diode of the other rail until it is empty, then floats. Returns the mean torque over k_e.
double resolved_current_A(double inductance_H, double resistance_ohm, double flat_emf_V, double electrical_rad_s, double bus_V,
                          double duty) {
  const auto emf = [&](double angle) {                  // of a phase, flat top from 30 to 150 degrees
    const double x = angle / (std::numbers::pi / 6.0);  // in units of 30 degrees
    const double y = std::fmod(std::fmod(x, 12.0) + 12.0, 12.0);
    return flat_emf_V * (y < 1.0 ? y : y < 5.0 ? 1.0 : y < 7.0 ? 6.0 - y : y < 11.0 ? -1.0 : y - 12.0);
  };
  // High and low phase of sectors that begin at 30, 90, … degrees.
  constexpr std::array<std::array<int, 2>, 6> kPairs = {{{0, 1}, {0, 2}, {1, 2}, {1, 0}, {2, 0}, {2, 1}}};
  std::array<double, 3> i = {0.0, 0.0, 0.0};
  constexpr int kStepsPerSector = 2000, kTurns = 40;
  const double dt_s = std::numbers::pi / 3.0 / electrical_rad_s / kStepsPerSector;
  double energy_J = 0.0, time_s = 0.0;
  for (int sector = 0; sector < 6 * kTurns; ++sector) {
    const std::size_t high = static_cast<std::size_t>(kPairs[static_cast<std::size_t>(sector % 6)][0]);
    const std::size_t low = static_cast<std::size_t>(kPairs[static_cast<std::size_t>(sector % 6)][1]);
    const std::size_t off = 3 - high - low;
    for (int k = 0; k < kStepsPerSector; ++k) {
      const double angle = (30.0 + 60.0 * (sector % 6)) * std::numbers::pi / 180.0 + (k + 0.5) / kStepsPerSector * std::numbers::pi / 3.0;
      std::array<double, 3> e{}, v{};
      for (std::size_t n = 0; n < 3; ++n) e[n] = emf(angle - 2.0 * std::numbers::pi / 3.0 * static_cast<double>(n));
      v[high] = duty * bus_V;
      v[low] = 0.0;
      v[off] = i[off] > 0.0 ? 0.0 : bus_V;
      const bool floats = i[off] == 0.0;
      double star = (v[0] + v[1] + v[2] - e[0] - e[1] - e[2]) / 3.0;
      if (floats) star = 0.5 * (v[high] + v[low] - e[high] - e[low]);
      const double before = i[off];
      for (std::size_t n = 0; n < 3; ++n)
        if (n != off || !floats) i[n] += dt_s / inductance_H * (v[n] - e[n] - resistance_ohm * i[n] - star);
      if (before * i[off] < 0.0) {  // empty within this step
        i[high] += 0.5 * i[off];
        i[low] += 0.5 * i[off];
        i[off] = 0.0;
      }
      if (sector >= 3 * kTurns) {
        energy_J += (e[0] * i[0] + e[1] * i[1] + e[2] * i[2]) * dt_s;
        time_s += dt_s;
      }
    }
  }
  return energy_J / time_s / (2.0 * flat_emf_V);
}

TEST(SixStep, MeanTorqueWithinTwoPercentOfABridgeResolvedPhaseByPhase) {
  SixStepParameters p = ideal();
  p.phase_inductance_H = 7e-6;
  for (const double rpm : {6000.0, 15000.0, 25000.0, 33000.0}) {
    const double omega = rpm * kRpm, emf_V = p.emf_constant_V_s * omega;
    const double duty = emf_V / 24.0 + 0.1;  // 2.4 V over the EMF
    const double resolved = resolved_current_A(7e-6, 0.5 * p.resistance_ohm, 0.5 * emf_V, 7 * omega, 24.0, duty);
    const SixStepPoint s = six_step_at(p, 24.0, duty, omega);
    std::printf("[ resolved ] %5.0f rpm: %.2f A, averaged %.2f A, without the commutation drop %.2f A, overlap %.2f\n", rpm, resolved,
                s.current_A, 0.1 * 24.0 / p.resistance_ohm, s.overlap_share);
    EXPECT_NEAR(s.current_A / resolved, 1.0, 0.02);
    EXPECT_GT(0.1 * 24.0 / p.resistance_ohm, 1.2 * resolved);
  }
}

}  // namespace
