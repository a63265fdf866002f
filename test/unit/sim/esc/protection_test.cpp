// Each protection of the motor control twice: what it does, and the damage when it is switched off.
#include <gtest/gtest.h>

#include "bench/hil/esc_lab/rpm_loop.hpp"
#include "sim/drive/battery.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;
using namespace rotorloop::esc_lab;
using firmware::Fault;
using firmware::Limiter;
using firmware::MotorState;

NativeEscConfig reference() {
  NativeEscConfig c;
  c.seed = 2;
  c.bus_V = 15.2;
  return c;
}

NativeEsc running_at(double rpm, NativeEscConfig c = reference(), const Change& change = {}) {
  NativeEsc esc = make_esc(c, kTriblade_N_m_s2, change);
  esc.set_setpoint(speed(rpm * kRpm));
  run_ms(esc, 700.0);
  return esc;
}

double phase_peak_A(const NativeEsc& esc) {
  const PhaseCurrents i = esc.drive().phase_currents_A();
  return std::max({std::fabs(i.u), std::fabs(i.v), std::fabs(i.w)});
}

// The rotor slips half an electrical turn (a blade strikes a twig): back-EMF and voltage now drive current together.
struct Slip {
  double peak_A = 0.0, off_after_pwm_periods = -1.0, beyond_us = 0.0;
};
Slip slip(std::uint64_t seed, bool protect) {
  NativeEscConfig config = reference();
  config.seed = seed;
  NativeEsc esc = running_at(16500, config, [&](NativeEsc& e) {
    if (protect) return;
    e.motor().config().protection.trip_A = 1e9f;
    e.motor().config().protection.trip_at_range_end = false;
    e.motor().config().protection.stall_ticks = 60000;
    e.motor().config().check.bridge = false;  // it opens the bridge too, on the second sample that no winding explains
  });
  esc.drive().motor().set_angle(esc.drive().motor().state().angle_rad + std::numbers::pi / 7.0);
  Slip r;
  double beyond_since = -1.0;
  for (int k = 0; k < 20 * kPeriodsPerMs; ++k) {
    if (beyond_since < 0.0 && phase_peak_A(esc) > 46.0) beyond_since = k * 2.0;
    esc.step_current_loop();
    r.peak_A = std::max(r.peak_A, phase_peak_A(esc));
    if (phase_peak_A(esc) > 45.0) r.beyond_us += 1e6 / kCurrentLoop_Hz;
    if (beyond_since >= 0.0 && r.off_after_pwm_periods < 0.0 && !esc.board().bridge) r.off_after_pwm_periods = 2.0 * k - beyond_since;
  }
  return r;
}

TEST(Protection, OvercurrentOpensTheBridgeWithinTwoPwmPeriodsOfTheSample) {
  // What the first sample meets depends on where in a turn the slip begins: the means of eight.
  Slip guarded, unguarded;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Slip with = slip(seed, true), without = slip(seed, false);
    EXPECT_GE(with.off_after_pwm_periods, 0.0) << seed;
    EXPECT_LE(with.off_after_pwm_periods, 2.0) << seed;
    guarded.peak_A += with.peak_A / 8.0;
    unguarded.peak_A += without.peak_A / 8.0;
    guarded.beyond_us += with.beyond_us / 8.0;
    unguarded.beyond_us += without.beyond_us / 8.0;
  }
  std::printf("slip of half a turn at 16 500 RPM: %.0f A peak, %.0f us beyond 45 A guarded; %.0f A, %.0f us not\n", guarded.peak_A,
              guarded.beyond_us, unguarded.peak_A, unguarded.beyond_us);
  EXPECT_GT(unguarded.peak_A, guarded.peak_A + 5.0);
  EXPECT_GT(unguarded.beyond_us, 2.0 * guarded.beyond_us);
}

TEST(Protection, AfterAnOvercurrentTripTheMotorIsBackWithin150Milliseconds) {
  NativeEsc esc = running_at(14000);
  esc.drive().motor().set_angle(esc.drive().motor().state().angle_rad + std::numbers::pi / 7.0);
  double back_ms = -1.0;
  run_ms(esc, 300.0, [&](double t) {
    if (std::fabs(esc.omega_rad_s() - 14000 * kRpm) > 10.0) back_ms = t;
  });
  EXPECT_GE(esc.motor().counters().errors(), 1u);
  EXPECT_LT(back_ms, 150.0);
  EXPECT_GE(esc.motor().counters().catches, 1u);
}

TEST(Protection, StallIsFoundAndTheMotorRestartsOnceFreed) {
  NativeEsc esc = running_at(6000);
  esc.drive().set_load({kTriblade_N_m_s2, 2.0});  // a branch in the propeller
  double off_ms = -1.0;
  run_ms(esc, 30.0, [&](double t) {
    if (off_ms < 0.0 && !esc.board().bridge) off_ms = t;
  });
  EXPECT_GE(off_ms, 0.0);
  EXPECT_LT(off_ms, 25.0);
  esc.drive().set_load({kTriblade_N_m_s2, 0.0});
  run_ms(esc, 1000.0);
  EXPECT_NEAR(esc.omega_rad_s(), 6000 * kRpm, 5.0);
}

TEST(Protection, ABlockedRotorIsGivenUpAfterSomeTriesUntilTheSetpointReturnsToOff) {
  NativeEscConfig c = reference();
  NativeEsc esc = make_esc(c);
  esc.drive().set_load({kTriblade_N_m_s2, 2.0});
  esc.set_setpoint(speed(6000 * kRpm));
  run_ms(esc, 6000.0);
  EXPECT_EQ(esc.telemetry().state, MotorState::fault);
  EXPECT_FALSE(esc.board().bridge);
  EXPECT_EQ(esc.motor().counters().latched_faults, 1u);
  esc.drive().set_load({kTriblade_N_m_s2, 0.0});
  run_ms(esc, 500.0);
  EXPECT_FALSE(esc.board().bridge);  // latched
  esc.set_setpoint({});
  run_ms(esc, 5.0);
  esc.set_setpoint(speed(6000 * kRpm));
  run_ms(esc, 800.0);
  EXPECT_NEAR(esc.omega_rad_s(), 6000 * kRpm, 5.0);
}

TEST(Protection, WithoutStallDetectionABlockedMotorIsReportedAsRunning) {
  NativeEsc esc = running_at(6000, reference(), [](NativeEsc& e) {
    e.motor().config().protection.stall_ticks = e.motor().config().protection.slip_ticks = 60000;
  });
  esc.drive().set_load({kTriblade_N_m_s2, 2.0});
  run_ms(esc, 500.0);
  EXPECT_LT(std::fabs(esc.omega_rad_s()), 5.0);
  EXPECT_TRUE(esc.board().bridge);  // current into a rotor that cannot turn, and nobody is told
  EXPECT_EQ(esc.telemetry().fault, Fault::none);
  EXPECT_EQ(esc.telemetry().error_count, 0u);
}

// A bench supply behind a diode: what is fed back only charges the bus capacitor.
struct RegenResult {
  double highest_V = 0.0;
  std::set<Limiter> limiters;
  std::uint32_t trips = 0;
  double slowed_rpm = 0.0;
};
RegenResult brake_on_a_supply_that_cannot_sink(float sink_A, bool overvoltage_trip) {
  NativeEscConfig c = reference();
  c.firmware.regen_current_limit_A = sink_A;
  NativeEsc esc = running_at(14000, c, [&](NativeEsc& e) {
    if (!overvoltage_trip) e.motor().config().protection.overvoltage_V = 1e6f;
  });
  BatteryParameters supply;
  supply.can_sink = false;
  supply.initial_charge = 0.8;
  supply.resistance_ohm = 0.01;
  Battery battery(supply);
  RegenResult r;
  esc.set_setpoint(speed(4000 * kRpm));
  for (int k = 0; k < 100 * kPeriodsPerMs; ++k) {
    esc.couple_quadratic(kTriblade_N_m_s2, battery.voltage_V());
    esc.step_current_loop();
    battery.step(esc.bus_current_A(), 1.0 / kCurrentLoop_Hz);
    if (k > 0) r.highest_V = std::max(r.highest_V, battery.voltage_V());
    r.limiters.insert(esc.telemetry().limiter);
  }
  r.trips = esc.motor().counters().overvoltage_trips;
  r.slowed_rpm = esc.omega_rad_s() / kRpm;
  return r;
}

TEST(Protection, BrakingOnASupplyThatCannotSinkKeepsTheBusDown) {
  const RegenResult limited = brake_on_a_supply_that_cannot_sink(0.0f, true);
  EXPECT_LT(limited.highest_V, 17.5);
  EXPECT_TRUE(limited.limiters.contains(Limiter::regen_current));
  EXPECT_LT(limited.slowed_rpm, 13000.0);                                     // it still slows down
  const RegenResult wrong = brake_on_a_supply_that_cannot_sink(40.0f, true);  // limit set for a battery
  EXPECT_GE(wrong.trips, 1u);
  EXPECT_LT(wrong.highest_V, 30.5);
  const RegenResult unguarded = brake_on_a_supply_that_cannot_sink(40.0f, false);
  std::printf("highest bus: %.1f V limited, %.1f V tripped, %.1f V with neither\n", limited.highest_V, wrong.highest_V,
              unguarded.highest_V);
  EXPECT_GT(unguarded.highest_V, 33.0);  // beyond the divider's full scale and the board's capacitors
}

TEST(Protection, UndervoltageDeratesThenOpensTheBridgeAndRecovers) {
  NativeEsc esc = running_at(9000);
  esc.couple_quadratic(kTriblade_N_m_s2, 12.4);  // 3.1 V per cell: a third of the derating span is left
  esc.set_setpoint(speed(12000 * kRpm));
  run_ms(esc, 50.0);
  EXPECT_EQ(esc.telemetry().limiter, Limiter::undervoltage);
  EXPECT_TRUE(esc.board().bridge);
  esc.couple_quadratic(kTriblade_N_m_s2, 11.5);
  run_ms(esc, 4.0);
  EXPECT_FALSE(esc.board().bridge);
  EXPECT_EQ(esc.telemetry().fault, Fault::undervoltage);
  esc.couple_quadratic(kTriblade_N_m_s2, 15.2);
  run_ms(esc, 300.0);
  EXPECT_NEAR(esc.omega_rad_s(), 12000 * kRpm, 10.0);

  NativeEsc flat = running_at(9000, reference(), [](NativeEsc& e) {
    e.motor().config().protection.undervoltage_V = e.motor().config().limits.undervoltage_V = -100.0f;
  });
  flat.couple_quadratic(kTriblade_N_m_s2, 11.5);  // 2.9 V per cell: below this a lithium cell is harmed
  run_ms(flat, 100.0);
  EXPECT_GT(flat.bus_current_A(), 2.0);  // still drawing
}

TEST(Protection, TemperatureDeratesThenOpensTheBridge) {
  NativeEsc esc = running_at(9000);
  esc.drive().set_temperature_K(353.0);  // 5 K below the limit: a quarter of the current
  esc.set_setpoint(speed(14000 * kRpm));
  run_ms(esc, 30.0);
  EXPECT_EQ(esc.telemetry().limiter, Limiter::temperature);
  EXPECT_LT(esc.drive().motor().state().i_q_A, 11.0);
  esc.drive().set_temperature_K(360.0);
  run_ms(esc, 5.0);
  EXPECT_FALSE(esc.board().bridge);
  EXPECT_EQ(esc.telemetry().fault, Fault::overtemperature);

  NativeEscConfig off = reference();
  off.firmware.temperature_limit_K = 1000.0f;
  NativeEsc hot = running_at(9000, off);
  hot.drive().set_temperature_K(360.0);
  hot.set_setpoint(speed(14000 * kRpm));
  run_ms(hot, 10.0);
  EXPECT_GT(hot.drive().motor().state().i_q_A, 30.0);  // full current into a board beyond its limit
}

TEST(Protection, AShuntThatReadsWrongIsFoundByTheSumOfCurrents) {
  NativeEsc esc = running_at(9000);
  esc.drive().sensing().parameters().gain[1] = 0.0;  // amplifier dead: the channel stays at its zero
  double off_ms = -1.0;
  run_ms(esc, 50.0, [&](double t) {
    if (off_ms < 0.0 && !esc.board().bridge) off_ms = t;
  });
  EXPECT_GE(off_ms, 0.0);
  EXPECT_LT(off_ms, 20.0);

  const auto ripple_A = [](bool protect, double gain) {
    NativeEsc e = running_at(9000, reference(), [&](NativeEsc& x) {
      if (!protect) x.motor().config().protection.residual_A = x.motor().config().check.sum_A = 1e9f;
    });
    e.drive().sensing().parameters().gain[1] = gain;
    double low = 1e9, high = -1e9;
    run_ms(e, 50.0, [&](double t) {
      if (t > 25.0) {
        low = std::min(low, e.drive().motor().state().i_q_A);
        high = std::max(high, e.drive().motor().state().i_q_A);
      }
    });
    return high - low;
  };
  const double healthy = ripple_A(true, 1.0), unguarded = ripple_A(false, 0.0);
  std::printf("torque current ripple at 9 000 RPM: %.1f A healthy, %.1f A with a dead shunt and no check\n", healthy, unguarded);
  EXPECT_GT(unguarded, 2.0 * healthy);
}

TEST(Protection, OffsetOutOfToleranceAtBootForbidsTheStart) {
  NativeEscConfig c = reference();
  c.draw_board_spread = false;
  c.drive.sensing.offset_counts[2] = 300.0;
  NativeEsc esc = make_esc(c);
  esc.set_setpoint(speed(5000 * kRpm));
  run_ms(esc, 100.0);
  EXPECT_FALSE(esc.board().bridge);
  EXPECT_EQ(esc.telemetry().fault, Fault::sensor);
  EXPECT_EQ(esc.motor().counters().calibration_failures, 1u);
}

TEST(Protection, ShortLowSideWindowsNeedTheTwoPhaseReconstruction) {
  const auto current_rms_error_A = [](bool reconstruct) {
    NativeEscConfig c = reference();
    c.bus_V = 14.0;
    NativeEsc esc = running_at(15500, c, [&](NativeEsc& e) {
      if (reconstruct) return;
      e.motor().config().sense.blind_compare = 65535;   // every sample accepted …
      e.motor().config().modulator.sample_duty = 1.0f;  // … and no room made for it
      e.motor().config().protection.residual_A = e.motor().config().check.sum_A = 1e9f;
      e.motor().config().protection.trip_A = 1e9f;
      e.motor().config().protection.trip_at_range_end = false;
    });
    double sum2 = 0.0;
    int n = 0;
    run_ms(esc, 100.0, [&](double) {
      const auto& s = esc.drive().motor().state();
      sum2 += std::pow(static_cast<double>(esc.motor().variables().wanted_A.q) - s.i_q_A, 2);
      ++n;
    });
    // A motor that cannot be held at all has no current to compare.
    return esc.telemetry().state == MotorState::running && esc.omega_rad_s() > 15000 * kRpm ? std::sqrt(sum2 / n) : 1e9;
  };
  const double with = current_rms_error_A(true), without = current_rms_error_A(false);
  std::printf("rms torque current error at 15 500 RPM, 14 V: %.2f A reconstructed, %s not\n", with,
              without < 1e8 ? std::to_string(without).c_str() : "cannot keep running");
  EXPECT_LT(with, 1.5);
  EXPECT_GT(without, 2.0 * with);
}

TEST(Protection, DeadTimeCompensationKeepsTheCurrentSinusoidal) {
  const auto flux_current_error_A = [](bool compensate) {
    NativeEsc esc = running_at(2500, reference(), [&](NativeEsc& e) {
      if (!compensate) e.motor().config().dead_time = {};  // none assumed, whatever was measured
    });
    run_ms(esc, 300.0);
    double sum2 = 0.0;
    int n = 0;
    run_ms(esc, 100.0, [&](double) {
      const double asked_A = static_cast<double>(esc.motor().variables().wanted_A.d);
      sum2 += std::pow(esc.drive().motor().state().i_d_A - asked_A, 2);
      ++n;
    });
    return std::sqrt(sum2 / n);
  };
  const double with = flux_current_error_A(true), without = flux_current_error_A(false);
  std::printf("rms d current error at 2 500 RPM: %.2f A compensated, %.2f A not\n", with, without);
  EXPECT_GT(without, 1.5 * with);
}

}  // namespace
