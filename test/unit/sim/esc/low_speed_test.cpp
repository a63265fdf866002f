// Low speed on drawn boards, where what the dead time takes from the voltage is more than the back-EMF: holding, catching, trying again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/hil/esc_lab/motor_classes.hpp"
#include "bench/hil/esc_lab/rpm_loop.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;
using namespace rotorloop::esc_lab;
using firmware::MotorState;

NativeEscConfig drawn(std::uint64_t seed) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = 15.2;
  c.typical_board = true;
  return c;
}

// Without what keeps the phases off the dead time's zone the observer's angle swings; the current itself is what differs.
TEST(LowSpeed, ACurrentAlongTheMagnetSteadiesTheEstimateAt1500Rpm) {
  const auto speed_error_rms_rad_s = [](bool held) {
    double sum2 = 0.0;
    int n = 0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      NativeEsc esc = make_esc(drawn(seed), kTriblade_N_m_s2, [&](NativeEsc& e) {
        if (!held) e.motor().config().hold.current_A = 0.0f;
      });
      esc.set_setpoint(speed(1500 * kRpm));
      run_ms(esc, 1000.0);
      run_ms(esc, 500.0, [&](double) {
        const double seen = static_cast<double>(esc.telemetry().speed_rad_s);
        sum2 += std::pow(seen - esc.omega_rad_s(), 2);
        ++n;
      });
    }
    return std::sqrt(sum2 / n);
  };
  const double with = speed_error_rms_rad_s(true), without = speed_error_rms_rad_s(false);
  std::printf("rms error of the reported speed at 1 500 RPM on six drawn boards: %.1f rad/s held, %.1f not\n", with, without);
  EXPECT_LT(with, 0.05 * 1500 * kRpm);
  EXPECT_GT(without, 1.5 * with);
}

TEST(LowSpeed, ARotorThatTurnsTooSlowlyForItsVoltageIsCaughtByItsShortCircuitCurrent) {
  for (const bool shorts : {true, false}) {
    int caught = 0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      NativeEsc esc = make_esc(drawn(seed), kTriblade_N_m_s2, [&](NativeEsc& e) {
        if (!shorts) e.motor().config().start.short_catch_speed_rad_s = 1e9f;
      });
      esc.drive().motor().state().omega_rad_s = 180.0;
      esc.set_setpoint(speed(6000 * kRpm));
      run_ms(esc, 450.0);
      EXPECT_EQ(esc.motor().counters().errors(), 0u) << seed;
      caught += static_cast<int>(esc.motor().counters().catches);
    }
    EXPECT_EQ(caught, shorts ? 6 : 0);
  }
}

TEST(LowSpeed, ARotorThatTurnsTheWrongWayIsBroughtToRestBeforeItIsAligned) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    NativeEsc esc = make_esc(drawn(seed));
    esc.drive().motor().state().omega_rad_s = -150.0;
    esc.set_setpoint(speed(6000 * kRpm));
    double at_align_rad_s = 1e9;
    run_ms(esc, 800.0, [&](double) {
      if (esc.telemetry().state == MotorState::align && at_align_rad_s > 1e8) at_align_rad_s = esc.omega_rad_s();
    });
    EXPECT_LT(std::fabs(at_align_rad_s), 60.0) << seed;
    EXPECT_NEAR(esc.omega_rad_s(), 6000 * kRpm, 10.0) << seed;
  }
}

// The same cause makes the same trip again, unless the current that led to it is smaller.
TEST(LowSpeed, AfterAFaultTheCurrentLimitIsLowerUntilASecondHasPassedWithoutOne) {
  NativeEsc esc = make_esc(drawn(1));
  esc.set_setpoint(speed(9000 * kRpm));
  run_ms(esc, 900.0);
  const auto highest_A = [&] { return esc.motor().variables().range.high_A; };
  const float healthy_A = highest_A();
  esc.drive().add_fault({DriveFaultKind::rotor_lock, 0, esc.drive().time_s(), esc.drive().time_s() + 0.02, 0.0});
  run_ms(esc, 60.0);
  ASSERT_GE(esc.telemetry().trips, 1u);
  run_ms(esc, 640.0);
  ASSERT_EQ(esc.telemetry().state, MotorState::running);
  EXPECT_LT(highest_A(), 0.8f * healthy_A);
  run_ms(esc, 1500.0);
  EXPECT_NEAR(highest_A(), healthy_A, 0.02f * healthy_A);
}

// A gimbal motor starts with one ampere, less than what 40 counts of drift make of nothing. Ablation: the zeros of the start kept.
TEST(LowSpeed, AGimbalMotorKeepsItsSpeedWhileTheZerosOfItsCurrentSensorsDrift) {
  for (const bool follows : {true, false}) {
    int turning = 0;
    double worst_counts = 0.0;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const EscDraw d = draw_esc(*find_motor_class("gimbal"), seed, Knowledge::data_sheet);
      NativeEscConfig c = drawn(seed);
      c.drive = d.drive;
      c.firmware = d.firmware;
      c.bus_V = d.bus_V;
      NativeEsc esc(c);
      if (!follows) esc.motor().config().sense.zero_rate = 0.0f;
      esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
      esc.set_setpoint(speed(60.0));
      run_ms(esc, 8000.0);
      const bool runs = esc.telemetry().state == MotorState::running && esc.motor().counters().errors() == 0;
      turning += runs && std::fabs(esc.omega_rad_s() - 60.0) < 2.0 ? 1 : 0;
      const SensingParameters& truth = esc.drive().sensing().parameters();
      for (std::size_t k = 0; k < 3; ++k) {
        const double zero = truth.current_zero_V * 4096.0 / truth.reference_V + truth.offset_counts[k] +
                            truth.drift_counts[k] * std::min(1.0, 8.0 / truth.drift_s);
        worst_counts = std::max(worst_counts, std::fabs(static_cast<double>(esc.motor().variables().sense.zero_counts[k]) - zero));
      }
    }
    std::printf("%d of 4 gimbal motors at speed after 8 s, zeros %s: at most %.1f counts off\n", turning,
                follows ? "followed" : "as at the start", worst_counts);
    EXPECT_TRUE(follows ? turning == 4 : turning <= 2) << turning;
    EXPECT_EQ(worst_counts < 1.5, follows);
  }
}

}  // namespace
