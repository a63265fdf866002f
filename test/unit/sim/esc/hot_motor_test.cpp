// A motor warmer than its data sheet: copper gains 39 % of resistance over 100 K, magnets lose about 0.1 % of flux per kelvin. The firmware
// trusts the data sheet; what keeps the observer is the resistance measured at every start and followed in flight.
#include <gtest/gtest.h>

#include "bench/hil/esc_lab/rpm_loop.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;
using namespace rotorloop::esc_lab;

// The motor of the reference quadrotor (vehicles/motors/2306_2300kv.toml: 18 uH across the magnet, 15 uH in the data sheet), hot.
NativeEscConfig hot_motor(std::uint64_t seed, double resistance_scale = 1.39, double flux_scale = 0.93) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = 15.2;
  c.drive.motor.inductance_H.q = 18e-6;
  c.drive.motor.resistance_ohm *= resistance_scale;
  c.drive.motor.flux_linkage_Wb *= flux_scale;
  return c;
}

// What was asked of the rotors in the general flight of scenarios/effects.toml: 575 to 1 405 rad/s, at most 10 rad/s per millisecond.
// Ramps between drawn speeds, a quarter of them down to the lowest, for 10 s. The winding's
// resistance goes to `end_scale` of its value at the start in the first 8 s.
void fly(NativeEsc& esc, std::uint64_t seed, double end_scale = 1.0) {
  constexpr double kLowest_rad_s = 575.0, kHighest_rad_s = 1405.0, kDuration_ms = 10'000.0;
  const RandomStream draw(seed, 0x464C59);
  double wanted_rad_s = 950.0;
  esc.set_setpoint(speed(wanted_rad_s));
  run_ms(esc, 700.0);
  const double cold_ohm = esc.drive().motor().parameters().resistance_ohm;
  double t_ms = 0.0;
  for (std::uint64_t k = 0; t_ms < kDuration_ms; k += 3) {
    const double target_rad_s =
        draw.uniform(k) < 0.25 ? kLowest_rad_s : kLowest_rad_s + (kHighest_rad_s - kLowest_rad_s) * draw.uniform(k + 1);
    const double slope_rad_s_ms = 1.0 + 9.0 * draw.uniform(k + 2);
    while (std::fabs(target_rad_s - wanted_rad_s) > 1e-9) {
      wanted_rad_s += std::clamp(target_rad_s - wanted_rad_s, -slope_rad_s_ms, slope_rad_s_ms);
      esc.set_setpoint(speed(wanted_rad_s));
      esc.drive().motor().parameters().resistance_ohm = cold_ohm * (1.0 + (end_scale - 1.0) * std::min(1.0, t_ms / 8000.0));
      run_ms(esc, 1.0);
      t_ms += 1.0;
    }
  }
}

void keep_to_the_data_sheet(NativeEsc& esc) {
  esc.motor().config().resistance.least_ohm = esc.motor().config().resistance.most_ohm = esc.motor().config().observer.resistance_ohm;
}
void do_not_learn_while_running(NativeEsc& esc) { esc.motor().config().resistance.learn_ohm_A_s = 0.0f; }

TEST(HotMotor, With39PercentMoreResistanceAnd7PercentLessFluxStarts20OutOf20WithinSixHundredMilliseconds) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    NativeEsc esc = make_esc(hot_motor(seed));
    esc.set_setpoint(speed(2000 * kRpm));
    double reached_ms = 1e9;
    run_ms(esc, 1000.0, [&](double t) {
      if (reached_ms > 1e8 && esc.omega_rad_s() >= 0.98 * 2000 * kRpm) reached_ms = t;
    });
    EXPECT_LE(reached_ms, 600.0) << "seed " << seed;
    EXPECT_NEAR(esc.omega_rad_s(), 2000 * kRpm, 0.02 * 2000 * kRpm) << "seed " << seed;
    EXPECT_EQ(esc.motor().counters().errors(), 0u) << "seed " << seed;
    EXPECT_NEAR(static_cast<double>(esc.motor().variables().resistance_ohm), 1.39 * 0.06 + 4e-3, 0.1 * 0.0874) << "seed " << seed;
  }
}

TEST(HotMotor, FliesTheSpeedsOfTheGeneralFlightWithoutAFault) {
  for (const double flux_scale : {0.93, 1.0})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      NativeEsc esc = make_esc(hot_motor(seed, 1.39, flux_scale));
      fly(esc, seed);
      EXPECT_EQ(esc.motor().counters().errors(), 0u) << "flux " << flux_scale << ", seed " << seed;
    }
}

TEST(HotMotor, TrustingTheDataSheetInsteadOfTheMeasurementLosesTheRotor) {
  std::uint32_t stalls = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    NativeEsc esc = make_esc(hot_motor(seed, 1.39, 1.0), kTriblade_N_m_s2, keep_to_the_data_sheet);
    fly(esc, seed);
    stalls += esc.motor().counters().stalls;
  }
  EXPECT_GT(stalls, 0u);
}

double resistance_error(NativeEsc& esc) {
  const double true_ohm = esc.drive().motor().parameters().resistance_ohm + 4e-3;  // and the switches
  return static_cast<double>(esc.motor().variables().resistance_ohm) / true_ohm - 1.0;
}

TEST(HotMotor, AWindingThatGainsOrLosesTheHeatOf100KelvinInFlightIsFollowedWithin15PercentWithoutAFault) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    NativeEsc heats = make_esc(hot_motor(seed, 1.0, 1.0)), cools = make_esc(hot_motor(seed, 1.39, 1.0));
    fly(heats, seed, 1.39);
    fly(cools, seed, 1.0 / 1.39);
    EXPECT_EQ(heats.motor().counters().errors(), 0u) << "seed " << seed;
    EXPECT_EQ(cools.motor().counters().errors(), 0u) << "seed " << seed;
    EXPECT_NEAR(resistance_error(heats), 0.0, 0.15) << "seed " << seed;
    EXPECT_NEAR(resistance_error(cools), 0.0, 0.15) << "seed " << seed;
  }
}

TEST(HotMotor, NotLearningWhileRunningLosesTheRotorOfAWindingThatHeatsInFlight) {
  std::uint32_t stalls = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    NativeEsc esc = make_esc(hot_motor(seed, 1.0, 1.0), kTriblade_N_m_s2, do_not_learn_while_running);
    fly(esc, seed, 1.39);
    stalls += esc.motor().counters().stalls;
  }
  EXPECT_GT(stalls, 0u);
}

TEST(HotMotor, SteadySpeedTeachesNothingFalseWithin40Seconds) {
  for (const double rpm : {3000.0, 9000.0}) {
    NativeEsc esc = make_esc(hot_motor(1, 1.0, 1.0));
    esc.set_setpoint(speed(rpm * kRpm));
    run_ms(esc, 40'000.0);
    EXPECT_NEAR(resistance_error(esc), 0.0, 0.05) << rpm << " RPM";
  }
}

// What an alignment can measure on a motor that is far off is still refused: 2.5 times the parameter is a bad joint, not heat.
TEST(HotMotor, AResistanceBeyond80PercentAboveTheParameterIsRefusedAndCounted) {
  NativeEsc esc = make_esc(hot_motor(1, 2.5, 1.0));
  esc.set_setpoint(speed(2000 * kRpm));
  run_ms(esc, 200.0);
  EXPECT_EQ(esc.motor().counters().resistance_refused, 1u);
  EXPECT_FLOAT_EQ(esc.motor().variables().resistance_ohm, 0.064f);
}

}  // namespace
