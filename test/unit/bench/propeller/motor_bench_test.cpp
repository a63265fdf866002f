// Throttle to thrust: recovery of a made-up bench, and the measured one with two rows held out.
#include "bench/propeller/motor_bench.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "bench/propeller/scaled_blade.hpp"

namespace rotorloop::propeller {
namespace {

const sim::Blade& triblade() {
  static const sim::Blade blade = sim::read_blade(ROTORLOOP_SOURCE_DIR "/vehicles/blades/triblade_5in.toml");
  return blade;
}

TEST(ScaledBlade, HelixStaysAHelixOfTheNewPitch) {
  const sim::Blade b = scaled_blade(triblade(), kBenchRadius_m, kBenchPitchRatio);
  EXPECT_EQ(b.radius_m, kBenchRadius_m);
  // Outer half: the shipped blade is a helix of 4.3 in to 0.3 degrees.
  for (std::size_t i = 5; i < b.stations.size(); ++i)
    EXPECT_NEAR(b.stations[i].twist_deg, std::atan(3.6 * 0.0254 / (2 * std::numbers::pi * b.stations[i].r_m)) * 180 / std::numbers::pi,
                0.5);
}
TEST(ScaledBlade, SameSizeAndPitchIsTheSameBlade) {
  const sim::Blade b = scaled_blade(triblade(), triblade().radius_m, 1.0);
  for (std::size_t i = 0; i < b.stations.size(); ++i) {
    EXPECT_NEAR(b.stations[i].chord_m, triblade().stations[i].chord_m, 1e-15);
    EXPECT_NEAR(b.stations[i].twist_deg, triblade().stations[i].twist_deg, 1e-12);
  }
}

// Rows of a chain whose parameters are known.
MotorBenchData made_up(const BenchParameters& truth) {
  MotorBenchData data;
  data.propeller.pole_pairs = data.motor_alone.pole_pairs = 7;
  sim::SixStepParameters drive = six_step_parameters(truth, 7);
  drive.static_friction_N_m = 4e-3;
  drive.viscous_friction_N_m_s = 3e-6;
  const PropellerCurve curve(triblade(), truth);
  const auto row = [&](double throttle, bool propeller) {
    const sim::SixStepPoint s =
        sim::six_step_steady(drive, 24.0, throttle, [&](double omega) { return propeller ? curve.torque_N_m(omega) : 0.0; });
    return MotorBenchRow{throttle, 24.0, s.bus_current_A, s.omega_rad_s, propeller ? curve.thrust_N(s.omega_rad_s) : 0.0};
  };
  for (int k = 1; k <= 5; ++k) data.motor_alone.rows.push_back(row(0.1 * k, false));
  for (int k = 1; k <= 10; ++k) data.propeller.rows.push_back(row(0.1 * k, true));
  return data;
}

TEST(MotorBench, FrictionAndThrottleCurveComeBackFromAMotorWithoutPropeller) {
  const BenchParameters truth;
  const EscCalibration esc = calibrate_esc(made_up(truth).motor_alone, six_step_parameters(truth, 7));
  EXPECT_NEAR(esc.static_friction_N_m, 4e-3, 1e-6);
  EXPECT_NEAR(esc.viscous_friction_N_m_s, 3e-6, 1e-9);
  for (const double throttle : {0.1, 0.25, 0.5, 0.8, 1.0}) EXPECT_NEAR(esc.duty_at(throttle), throttle, 1e-6);
}
TEST(MotorBench, FitFindsInductanceAndChordOfAMadeUpBench) {
  BenchParameters truth;
  truth.phase_inductance_H = 8e-6;
  truth.chord_scale = 0.7;
  BenchParameters start;
  start.phase_inductance_H = 10e-6;
  start.chord_scale = 0.75;
  const MotorBenchResult r = fit_motor_bench(made_up(truth), triblade(), {BenchScalar::inductance, BenchScalar::chord}, {3, 7}, start);
  EXPECT_NEAR(r.parameters.phase_inductance_H, 8e-6, 1e-8);
  EXPECT_NEAR(r.parameters.chord_scale, 0.7, 1e-3);
  EXPECT_LT(r.worst_held_out.omega_rad_s, 1e-3);
  EXPECT_LT(r.worst_held_out.bus_A, 1e-3);
  EXPECT_LT(r.worst_held_out.thrust_N, 1e-3);
}

// Measured: JS 2306 1800 rpm/V, HQ 5136, six cells, ten throttle steps.
TEST(MeasuredMotorBench, HeldOutRpmWithin3PercentCurrentWithin8PercentThrustWithin6Percent) {
  if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set: motor bench not checked";
  const MotorBenchResult r = validate_motor_bench(std::getenv("ROTORLOOP_DATA"), ROTORLOOP_SOURCE_DIR "/vehicles/blades/triblade_5in.toml");
  for (const std::string& line : report_lines(r)) std::printf("[ measured ] %s\n", line.c_str());
  EXPECT_TRUE(r.fit.converged);
  EXPECT_LE(r.fit.values.size(), 4u);
  for (const bool at_bound : r.fit.at_bound) EXPECT_FALSE(at_bound);
  int held_out = 0;
  for (const BenchComparison& c : r.rows) {
    held_out += c.held_out;
    EXPECT_LT(c.overlap_share, 1.0);  // the averaged commutation holds
  }
  EXPECT_EQ(held_out, 2);
  EXPECT_LE(r.worst_held_out.omega_rad_s, kBenchLimits.omega);
  EXPECT_LE(r.worst_held_out.bus_A, kBenchLimits.bus_A);
  EXPECT_LE(r.worst_held_out.thrust_N, kBenchLimits.thrust);
  EXPECT_TRUE(within_limits(r));
  // Without a fit the same rows miss by far: the limits are not met by any blade and motor.
  EXPECT_GT(r.rows[3].unfitted.thrust_N, 1.2 * r.rows[3].measured.thrust_N);
}

}  // namespace
}  // namespace rotorloop::propeller
