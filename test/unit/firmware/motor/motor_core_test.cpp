// The pure steps of the motor control, each against its own specification, without any plant.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "firmware/board/fake/fake_board.hpp"
#include "firmware/core/motor/motor.hpp"

namespace {

using namespace rotorloop::firmware;

TEST(Angle, SineAndCosineAreWithinAMillionthOverTheTurn) {
  for (int k = 0; k < 100000; ++k) {
    const Angle a{static_cast<std::uint32_t>(k) * 42949u};
    const double x = a.raw * (2.0 * M_PI / 4294967296.0);
    const Rotation r = rotation(a);
    ASSERT_NEAR(static_cast<double>(r.cos), std::cos(x), 1e-6);
    ASSERT_NEAR(static_cast<double>(r.sin), std::sin(x), 1e-6);
  }
}

TEST(Angle, WrapsWithoutLosingAnything) {
  Angle a{};
  for (int k = 0; k < 7; ++k) a = a + Angle::from_rad(2.0f * kPi / 7.0f);
  EXPECT_NEAR(a.rad(), 0.0f, 1e-5f);
}

TEST(Vector, ParkAndItsInverseReturnTheVectorAndClarkeTheBalancedPhases) {
  const Rotation at = rotation(Angle::from_rad(1.1f));
  const Stator back = inverse_park(park({3.0f, -2.0f}, at), at);
  EXPECT_NEAR(back.a, 3.0f, 1e-5f);
  EXPECT_NEAR(back.b, -2.0f, 1e-5f);
  const Stator round = clarke(inverse_clarke({1.5f, 0.7f}));
  EXPECT_NEAR(round.a, 1.5f, 1e-6f);
  EXPECT_NEAR(round.b, 0.7f, 1e-6f);
}

SenseConfig sense_config() { return {-0.03f, 2553.0f, 100.0f, 1500, 120}; }
SenseState calibrated() {
  SenseState s;
  s.zero_counts = {2553.0f, 2553.0f, 2553.0f};
  s.calibrated = true;
  return s;
}

TEST(CurrentSense, LearnsTheZeroOf256SamplesAndRefusesOneOutOfTolerance) {
  SenseState s;
  for (int k = 0; k < 256; ++k) calibrate_zero(sense_config(), s, {{2540, 2560, 2600}, 0, 0});
  EXPECT_TRUE(s.calibrated);
  EXPECT_FLOAT_EQ(s.zero_counts[2], 2600.0f);
  SenseState bad;
  for (int k = 0; k < 256; ++k) calibrate_zero(sense_config(), bad, {{2553, 2553, 2700}, 0, 0});
  EXPECT_FALSE(bad.calibrated);
  EXPECT_TRUE(bad.zero_out_of_tolerance);
}

TEST(CurrentSense, FollowsAZeroThatDriftsWhereTheHighSideIsOnForLongEnoughAndNoSpoiltConversion) {
  SenseConfig c = sense_config();
  c.zero_compare = 260;
  c.zero_rate = 0.01f;
  float zero_counts = 2553.0f;
  for (int k = 0; k < 1000; ++k) follow_zero(c, zero_counts, static_cast<std::uint16_t>(2553 + k / 50), 800);  // 20 counts in 1 000 looks
  EXPECT_NEAR(zero_counts, 2572.0f, 2.0f);
  const float followed = zero_counts;
  for (const int spoilt : {0, 2400, 2700, 4095}) follow_zero(c, zero_counts, static_cast<std::uint16_t>(spoilt), 800);
  follow_zero(c, zero_counts, static_cast<std::uint16_t>(2580), 259);  // the amplifier still shows something of the current
  EXPECT_EQ(zero_counts, followed);
}

TEST(CurrentSense, TakesTheTwoBestPhasesWhenTheThirdHadNoWindow) {
  AdcCounts adc{{2553 - 300, 2553 + 100, 2553 + 200}, 0, 0};  // +9, -3, -6 A
  const Sensed all = sense_currents(sense_config(), calibrated(), adc, {{800, 700, 600}});
  EXPECT_NEAR(all.phase_A[0], 9.0f, 1e-4f);
  adc.phase[0] = 2553;  // unsettled: reads nothing
  const Sensed two = sense_currents(sense_config(), calibrated(), adc, {{1700, 700, 600}});
  EXPECT_EQ(two.usable, 2);
  EXPECT_NEAR(two.phase_A[0], 9.0f, 1e-4f);
  const Sensed sensed = sense_currents(sense_config(), calibrated(), adc, {{800, 700, 600}});  // without the rule
  EXPECT_GT(std::fabs(sensed.phase_A[0] - 9.0f), 2.0f);
}

TEST(CurrentSense, CommonErrorIsRemovedAndReportedAsResidual) {
  const Sensed s = sense_currents(sense_config(), calibrated(), {{2553 + 40, 2553 + 40, 2553 + 40}, 0, 0}, {{800, 800, 800}});
  EXPECT_NEAR(s.current_A.a, 0.0f, 1e-5f);
  EXPECT_NEAR(s.residual_A, -3.6f, 1e-4f);
}

TEST(CurrentSense, ConverterAtItsEndMeansBeyondRange) {
  EXPECT_TRUE(sense_currents(sense_config(), calibrated(), {{4095, 2553, 2553}, 0, 0}, {{800, 800, 800}}).at_end_of_range);
  EXPECT_FALSE(sense_currents(sense_config(), calibrated(), {{4000, 2553, 2553}, 0, 0}, {{800, 800, 800}}).at_end_of_range);
}

ModulatorConfig ideal_bridge() { return {1771.0f, 1.0f / 1771.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.85f}; }

TEST(Modulator, MakesTheVoltageAskedInEveryDirectionUpToTheCircle) {
  for (int degree = 0; degree < 360; ++degree) {
    const Rotation at = rotation(Angle::from_rad(static_cast<float>(degree) * kPi / 180.0f - kPi));
    for (const float share : {0.1f, 0.5f, 0.99f}) {
      const Stator v = inverse_park({share * voltage_limit_V(ideal_bridge(), 15.0f), 0.0f}, at);
      const Modulated m = modulate(ideal_bridge(), v, {}, 15.0f, 0.0f);
      EXPECT_NEAR(15.0f * m.duty.a, v.a, 0.012f) << degree;  // a compare step is 8.5 mV
      EXPECT_NEAR(15.0f * m.duty.b, v.b, 0.012f) << degree;
    }
  }
}

TEST(Modulator, LeavesTwoPhasesASampleWindowEverywhereOnTheCircle) {
  for (int degree = 0; degree < 360; ++degree) {
    const Rotation at = rotation(Angle::from_rad(static_cast<float>(degree) * kPi / 180.0f - kPi));
    const Modulated m = modulate(ideal_bridge(), inverse_park({0.96f * voltage_limit_V(ideal_bridge(), 15.0f), 0.0f}, at), {}, 15.0f, 0.0f);
    int blind = 0;
    for (const auto c : m.compare.phase) blind += c > 0.851f * 1771.0f ? 1 : 0;
    EXPECT_LE(blind, 1) << degree;
  }
}

TEST(Modulator, DeadTimeIsAddedAlongTheCurrentAndSaidToBeLost) {
  const Modulated m = modulate(ideal_bridge(), {1.0f, 0.0f}, {10.0f, 0.0f}, 15.0f, 0.0384f);
  EXPECT_NEAR(15.0f * m.duty.a - m.lost_V.a, 1.0f, 0.012f);
  EXPECT_NEAR(m.lost_V.a, 4.0f / 3.0f * 0.0384f * 15.0f, 1e-3f);
}

TEST(Modulator, NoInputMakesACompareBeyondTheTop) {
  std::mt19937 random(1);
  for (int k = 0; k < 10000; ++k) {
    const auto draw = [&] { return (static_cast<float>(random()) / 4294967296.0f - 0.5f) * 200.0f; };
    const Modulated m = modulate(ideal_bridge(), {draw(), draw()}, {draw(), draw()}, draw(), 0.0384f);
    for (const auto c : m.compare.phase) ASSERT_LE(c, 1771);
  }
}

// The current loop on the exact discrete motor it was designed for, with its one-period delay.
std::array<float, 40> step_response(float omega_e_rad_s, float inductance_factor = 1.0f, bool angle_terms = true) {
  const MotorConfig c = configure<FakeBoard>(Parameters{});
  const float phi = omega_e_rad_s * c.period_s;
  const FrameMotion frame = frame_motion(angle_terms ? omega_e_rad_s : 0.0f, c.period_s);
  const float decay = std::exp(-0.064f * c.period_s / (15e-6f * inductance_factor));
  CurrentLoopState s;
  Rotor i{}, pending{};
  std::array<float, 40> out{};
  const Rotation full = rotation(Angle::from_rad(phi)), half = rotation(Angle::from_rad(0.5f * phi));
  for (float& x : out) {
    const CurrentLoopStep step_out = step(c.current, s, {0.0f, 10.0f}, i, frame, false, 1e3f);
    i = decay * (conjugate(full) * i) + ((1.0f - decay) / 0.064f) * (conjugate(half) * pending);
    pending = step_out.v_V;
    x = i.q;
  }
  return out;
}

TEST(CurrentLoop, SettlesIn600MicrosecondsWithoutOvershootAtAnySpeed) {
  for (const float krpm : {0.0f, 50.0f, 119.0f, 200.0f}) {
    const auto y = step_response(krpm * 1000.0f / 60.0f * 2.0f * kPi);
    EXPECT_GT(y[14], 9.0f) << krpm;
    for (const float x : y) EXPECT_LT(x, 10.05f) << krpm;
    EXPECT_NEAR(y.back(), 10.0f, 0.01f) << krpm;
  }
}

TEST(CurrentLoop, WithoutTheAngleTermsItIsUnstableAt200ThousandElectricalRpm) {
  const auto y = step_response(200e3f / 60.0f * 2.0f * kPi, 1.0f, false);
  float most = 0.0f;
  for (const float x : y) most = std::max(most, std::fabs(x - 10.0f));
  EXPECT_GT(std::fabs(y.back() - 10.0f) + most, 5.0f);
}

// Data sheet ± 20 %, and an axis that differs from the mean by another 17 %.
TEST(CurrentLoop, ToleratesFortyPercentOfInductance) {
  for (const float factor : {0.65f, 1.4f}) {
    const auto y = step_response(119e3f / 60.0f * 2.0f * kPi, factor);
    EXPECT_NEAR(y.back(), 10.0f, 0.1f);
    for (const float x : y) EXPECT_LT(x, 12.0f);
  }
}

TEST(CurrentLoop, DoesNotWindUpAtTheVoltageLimit) {
  const MotorConfig c = configure<FakeBoard>(Parameters{});
  CurrentLoopState s;
  const FrameMotion still = frame_motion(0.0f, c.period_s);
  // Asked for 40 A against a back-EMF that leaves no room, for one second.
  for (int k = 0; k < 24000; ++k) step(c.current, s, {0.0f, 40.0f}, {0.0f, 0.0f}, still, false, 5.0f);
  EXPECT_LE(length(s.integral_V), 5.01f);
  const CurrentLoopStep freed = step(c.current, s, {0.0f, -40.0f}, {0.0f, 0.0f}, still, false, 5.0f);
  EXPECT_LT(freed.v_V.q, 5.0f - 0.9f * 40.0f * c.current.gain_V_A);  // answers at once
}

TEST(Observer, FindsAngleSpeedAndFluxOfARotatingMagnetBothWays) {
  const MotorConfig c = configure<FakeBoard>(Parameters{});
  for (const double w : {1500.0, 12461.0, 20944.0, -7477.0}) {
    ObserverState s;
    double theta = 1.0;
    for (int k = 0; k < 4800; ++k) {
      // Voltage that a magnet of 3.42e-4 Wb induces over one period, no current.
      const double next = theta + w / 24000.0;
      const Stator v{static_cast<float>(3.42e-4 * (std::cos(next) - std::cos(theta)) * 24000.0),
                     static_cast<float>(3.42e-4 * (std::sin(next) - std::sin(theta)) * 24000.0)};
      theta = next;
      step(c.observer, s, v, {}, 0.064f, 0.0f, k > 1200);
    }
    EXPECT_NEAR(static_cast<double>(s.speed_e_rad_s) / w, 1.0, 1e-3) << w;
    EXPECT_NEAR(std::remainder(static_cast<double>(s.angle.rad()) - theta, 2.0 * M_PI), 0.0, 0.02) << w;
    EXPECT_NEAR(s.flux_ratio, 1.0f, 0.02f) << w;
    EXPECT_GT(s.lock, 0.99f) << w;
  }
}

TEST(Observer, WithoutVoltageItDoesNotClaimALockedRotation) {
  const MotorConfig c = configure<FakeBoard>(Parameters{});
  ObserverState s;
  for (int k = 0; k < 4800; ++k) step(c.observer, s, {}, {}, 0.064f, 0.0f, false);
  EXPECT_LT(std::fabs(s.omega_e_rad_s), 50.0f);
}

// The flux ratio that an assumed resistance makes the observer see, at 6 000 electrical rad/s, for a torque current.
float learnt_ohm(float true_ohm, float true_flux_ratio, float mean_A, float swing_A, int ticks) {
  const MotorConfig c = configure<FakeBoard>(Parameters{});
  ResistanceState s{true_flux_ratio, 0.0f};
  float assumed_ohm = 0.064f;
  for (int k = 0; k < ticks; ++k) {
    const float i_A = mean_A + swing_A * std::sin(0.01f * static_cast<float>(k)), x = i_A / 6000.0f;
    assumed_ohm = step(c.resistance, s, assumed_ohm, true_flux_ratio + (true_ohm - assumed_ohm) * x / 3.42e-4f, i_A, 6000.0f);
  }
  return assumed_ohm;
}

TEST(Resistance, IsFoundWithin2PercentIn10SecondsOfSwingingCurrentWhateverTheFlux) {
  for (const float flux_ratio : {0.8f, 1.0f, 1.2f})
    for (const float ohm : {0.050f, 0.064f, 0.0874f})
      EXPECT_NEAR(learnt_ohm(ohm, flux_ratio, 8.0f, 15.0f, 40000), ohm, 0.02f * ohm) << flux_ratio;
}

TEST(Resistance, StaysWhileTheCurrentIsSteadyAndWithinTheBoundsAssumed) {
  EXPECT_NEAR(learnt_ohm(0.0874f, 0.8f, 8.0f, 0.0f, 40000), 0.064f, 0.002f);
  EXPECT_FLOAT_EQ(learnt_ohm(0.5f, 1.0f, 8.0f, 15.0f, 40000), kResistanceMost * 0.064f);
  EXPECT_FLOAT_EQ(learnt_ohm(0.0f, 1.0f, 8.0f, 15.0f, 40000), kResistanceLeast * 0.064f);
}

PowerLimitConfig power() { return {0.06f, 3.59e-3f}; }

TEST(Limits, BrakingRangeForASupplyThatCannotSinkIsWhereTheWindingBurnsAllOfIt) {
  const float w = 1000.0f;
  const SinkGap gap = sink_gap(power(), w, 0.0f);
  ASSERT_TRUE(gap.exists);
  EXPECT_NEAR(gap.near_A, 0.0f, 1e-4f);
  EXPECT_NEAR(gap.far_A, -3.59e-3f * w / (1.5f * 0.06f), 1e-3f);  // 40 A
  const auto power_W = [&](float i) { return 1.5f * 0.06f * i * i + 3.59e-3f * w * i; };
  EXPECT_GE(power_W(gap.far_A - 0.1f), 0.0f);
  EXPECT_LT(power_W(0.5f * gap.far_A), 0.0f);
}

TEST(Limits, ASupplyThatSinksEnoughHasNoGapAndOneThatSinksALittleASmallerOne) {
  EXPECT_FALSE(sink_gap(power(), 1000.0f, 100.0f).exists);  // most that can come back is (Kt w)²/(6 R) = 36 W
  const SinkGap some = sink_gap(power(), 1000.0f, 10.0f);
  ASSERT_TRUE(some.exists);
  EXPECT_NEAR(1.5f * 0.06f * some.near_A * some.near_A + 3.59f * some.near_A, -10.0f, 0.01f);
}

LimitConfig limits() {
  LimitConfig c;
  c.power = power();
  c.brake = {0.8f * 0.06f, 3.59e-3f};
  c.asked_A = 36.0f;
  c.source_A = c.sink_A = 40.0f;
  c.undervoltage_V = 12.0f;
  c.temperature_K = 358.0f;
  c.observer_A_s_rad = 1.0f;
  return c;
}

// 44 A of trip, less gains, zeros and what the bus moves in a sample that nothing answers.
TEST(Limits, ABoardOf44AmperesHolds36AOf15MicrohenryAt16VoltsAnd30AOf6MicrohenryAt24AndSaysSo) {
  Parameters wide;
  LimitConfig c = configure<FakeBoard>(wide).limits;
  hold_to_range(c, 16.0f);
  EXPECT_FLOAT_EQ(c.share * c.asked_A, 36.0f);
  EXPECT_EQ(c.phase_by, Limiter::phase_current);
  Parameters narrow;
  narrow.inductance_H = 6e-6f;
  c = configure<FakeBoard>(narrow).limits;
  hold_to_range(c, 24.0f);
  EXPECT_NEAR(c.share * c.asked_A, 30.4f, 0.1f);
  const LimitInputs fast{1500.0f, 24.0f, 300.0f, 0.0f};
  c.source_A = c.sink_A = 1000.0f;
  EXPECT_EQ(limit_current(current_range(c, fast), 100.0f, 1.0f).by, Limiter::sensor_range);
  hold_to_range(c, 15.0f);  // less bus, more current
  EXPECT_GT(c.share * c.asked_A, 34.0f);
}

// A limit above what is left of the trip for the swing of the current is not served, however little the bus moves it in a sample.
TEST(Limits, ABoardOf44AmperesHolds36AOfALimitOf45AWith70MicrohenryAndSaysSo) {
  Parameters large;
  large.inductance_H = 70e-6f;
  large.phase_current_limit_A = 45.0f;
  LimitConfig c = configure<FakeBoard>(large).limits;
  for (const float bus_V : {21.0f, 25.2f}) {
    hold_to_range(c, bus_V);
    EXPECT_NEAR(c.share * c.asked_A, 36.2f, 0.1f) << bus_V;
    EXPECT_EQ(c.phase_by, Limiter::sensor_range) << bus_V;
  }
}

TEST(Limits, NameTheRuleThatBinds) {
  const auto by = [](const LimitConfig& c, LimitInputs in, float wanted) { return limit_current(current_range(c, in), wanted, 1.0f).by; };
  const LimitInputs calm{1000.0f, 16.0f, 300.0f, 0.0f};
  EXPECT_EQ(by(limits(), calm, 30.0f), Limiter::none);
  EXPECT_EQ(by(limits(), calm, 39.0f), Limiter::phase_current);
  EXPECT_EQ(by(limits(), {1000.0f, 16.0f, 350.0f, 0.0f}, 30.0f), Limiter::temperature);
  EXPECT_EQ(by(limits(), {1000.0f, 12.5f, 300.0f, 0.0f}, 30.0f), Limiter::undervoltage);
  EXPECT_EQ(by(limits(), {10.0f, 16.0f, 300.0f, 0.0f}, 30.0f), Limiter::observer);
  LimitConfig c = limits();
  c.source_A = 3.0f;
  EXPECT_EQ(by(c, calm, 30.0f), Limiter::bus_current);
  c.sink_A = 0.0f;
  EXPECT_EQ(by(c, calm, -20.0f), Limiter::regen_current);
}

TEST(Limits, ALimitedDriveStaysWithinTheSupplysCurrent) {
  LimitConfig c = limits();
  c.source_A = 5.0f;
  for (const float w : {200.0f, 800.0f, 1600.0f}) {
    const Limited l = limit_current(current_range(c, {w, 16.0f, 300.0f, 0.0f}), 40.0f, 1.0f);
    EXPECT_LE(1.5f * 0.06f * l.current_A * l.current_A + 3.59e-3f * w * l.current_A, 5.0f * 16.0f * 1.001f) << w;
  }
}

TEST(Limits, MirrorForTheOtherDirection) {
  const CurrentRange r = current_range(limits(), {-1000.0f, 16.0f, 300.0f, 0.0f});
  EXPECT_FLOAT_EQ(limit_current(r, -50.0f, -1.0f).current_A, -limit_current(r, 50.0f, 1.0f).current_A);
}

CurrentRange wide() {
  CurrentRange r;
  r.low_A = -36.0f;
  r.high_A = 36.0f;
  return r;
}

TEST(SpeedLoop, CarriesTheLoadByFeedForwardAlone) {
  const SpeedLoopConfig c = configure<FakeBoard>(Parameters{}).speed;
  SpeedLoopState s;
  enter(c, s, 1000.0f, c.load_A_s2 * 1e6f);
  const SpeedLoopStep out = step(c, s, 1000.0f, 1000.0f, wide(), false);
  EXPECT_NEAR(out.current_A, 3.0e-8f * 1e6f / (1.5f * 7.0f * Parameters{}.flux_linkage_Wb), 1e-3f);
  EXPECT_NEAR(s.integral_A, 0.0f, 1e-3f);
}

TEST(SpeedLoop, IntegralStandsStillWhileALimiterPushesBack) {
  const SpeedLoopConfig c = configure<FakeBoard>(Parameters{}).speed;
  SpeedLoopState s;
  enter(c, s, 700.0f, 5.0f);
  const float before = s.integral_A;
  for (int k = 0; k < 4000; ++k) EXPECT_EQ(step(c, s, 1500.0f, 700.0f, wide(), false).limiter, Limiter::phase_current);
  EXPECT_NEAR(s.integral_A, before, 0.5f);
  SpeedLoopConfig loose = c;
  loose.hold_at_limit = false;
  SpeedLoopState wound = s;
  for (int k = 0; k < 4000; ++k) step(loose, wound, 1500.0f, 700.0f, wide(), false);
  EXPECT_GT(wound.integral_A, 1000.0f);
}

TEST(SpeedLoop, RaisesASmallSetpointAndLowersALargeOne) {
  const SpeedLoopConfig c = configure<FakeBoard>(Parameters{}).speed;
  SpeedLoopState s;
  enter(c, s, 105.0f, 0.0f);
  EXPECT_EQ(step(c, s, 10.0f, 105.0f, wide(), false).limiter, Limiter::min_speed);
  EXPECT_FLOAT_EQ(s.slewed_rad_s, 105.0f);
  enter(c, s, 1780.0f, 26.0f);
  EXPECT_EQ(step(c, s, 5000.0f, 1780.0f, wide(), false).limiter, Limiter::max_speed);
  EXPECT_FLOAT_EQ(s.slewed_rad_s, 1780.0f);
}

// What the sequence decides about a rotor whose windings are shorted and that the observer reports like this, for 400 ms.
template <class Observed>
StartStep look(const Observed& observed, StartState& s) {
  const StartConfig c = configure<FakeBoard>(Parameters{}).start;
  s = {MotorState::catching, 0.0f, 0.0f, 1.0f};
  s.shorted = true;
  StartStep out;
  for (int k = 0; k < 1600 && s.phase == MotorState::catching && !out.caught; ++k) out = step(c, s, observed(k));
  return out;
}

TEST(StartUp, CatchesATrustedSteadyRotationAndAlignsAnythingElse) {
  StartInputs turning;
  turning.observed_rad_s = 500.0f;
  turning.lock = 0.99f;
  turning.flux_ratio = 1.0f;
  turning.current_A = 8.0f;
  StartState s;
  EXPECT_TRUE(look([&](int) { return turning; }, s).caught);
  StartInputs untrusted = turning;
  untrusted.lock = 0.5f;
  EXPECT_FALSE(look([&](int) { return untrusted; }, s).caught);
  EXPECT_EQ(s.phase, MotorState::align);
  // Noise of a standing rotor: locked, fast, but never the same.
  EXPECT_FALSE(look(
                   [&](int k) {
                     StartInputs wandering = turning;
                     wandering.observed_rad_s = 350.0f * std::sin(0.15f * static_cast<float>(k));
                     return wandering;
                   },
                   s)
                   .caught);
  EXPECT_EQ(s.phase, MotorState::align);
}

TEST(StartUp, HoldsARotorWhereItWasSeenTurningAndSweepsForOneThatWasNot) {
  StartInputs nearly_at_rest;
  nearly_at_rest.observed_rad_s = -30.0f;
  nearly_at_rest.lock = 0.99f;
  nearly_at_rest.flux_ratio = 1.0f;
  nearly_at_rest.current_A = 1.0f;
  nearly_at_rest.observed = Angle::from_rad(2.0f);
  StartState s;
  look([&](int) { return nearly_at_rest; }, s);
  ASSERT_EQ(s.phase, MotorState::align);
  const StartConfig c = configure<FakeBoard>(Parameters{}).start;
  // 2 rad, less 30 rad/s · 7 · 4 ms, is nearest to 60 degrees.
  EXPECT_NEAR(s.axis.rad(), kPi / 3.0f, 1e-5f);
  EXPECT_GE(s.in_phase_s, c.align_first_s);
  EXPECT_NEAR(step(c, s, nearly_at_rest).frame.rad(), kPi / 3.0f, 1e-5f);

  StartInputs unseen = nearly_at_rest;
  unseen.lock = 0.5f;
  look([&](int) { return unseen; }, s);
  ASSERT_EQ(s.phase, MotorState::align);
  EXPECT_LT(s.in_phase_s, c.align_first_s);
  EXPECT_NEAR(step(c, s, unseen).frame.rad(), c.align_from_rad, 0.1f);
}

// What the pulses (rotor_finder.hpp) say of a rotor at this electrical speed whose pulses drive this current per volt-second of EMF, in
// shares of the parameter's 1/L; zeros that are off add a standing current.
struct Pulsed {
  Finding finding = Finding::looking;
  FinderState state{};
  Angle rotor{};
  float omega_e_rad_s = 0.0f;
  int samples = 0;
};
Pulsed pulse_a_rotor(float omega_e_rad_s, float conductance_share = 1.0f, Stator offset_A = {}) {
  const FinderConfig c = configure<FakeBoard>(Parameters{}).finder;
  Pulsed p;
  p.state.low.fill(c.least_low);
  p.rotor = Angle::from_rad(0.3f);
  while (p.finding == Finding::looking && p.samples < 2000) {
    omega_e_rad_s -= c.period_s * c.load_e_1_rad * omega_e_rad_s * magnitude(omega_e_rad_s);  // as its propeller slows it
    p.rotor = p.rotor + Angle::from_rad(omega_e_rad_s * c.period_s);
    const float since_s = p.state.low[0] * c.half_pwm_s - c.dead_s;
    const Rotation emf_at = rotation(p.rotor + Angle::from_rad(-0.5f * omega_e_rad_s * since_s));
    const float A = -omega_e_rad_s * c.flux_linkage_Wb * since_s * c.over_inductance * conductance_share;
    p.finding = step(c, p.state, Stator{-A * emf_at.sin, A * emf_at.cos} + offset_A, 1.0f);
    ++p.samples;
  }
  p.omega_e_rad_s = omega_e_rad_s;
  return p;
}

TEST(RotorFinder, AngleWithin1DegreeAndSpeedWithin1PercentBothWaysUpTo200KeRpmWithInductance30PercentWrong) {
  for (const float omega_e_rad_s : {5500.0f, -6000.0f, 8000.0f, 14000.0f, -20900.0f})
    for (const float share : {0.77f, 1.0f, 1.43f}) {
      const Pulsed p = pulse_a_rotor(omega_e_rad_s, share);
      ASSERT_EQ(p.finding, Finding::found) << omega_e_rad_s;
      EXPECT_NEAR((p.state.angle - p.rotor).rad(), 0.0f, 0.0175f) << omega_e_rad_s;
      EXPECT_NEAR(p.state.omega_e_rad_s / p.omega_e_rad_s, 1.0f, 0.01f);
      EXPECT_LT(p.samples, 0.0070f * 24000.0f);
    }
}

TEST(RotorFinder, ZerosOffBy20CountsMakeNoRotorTurnAndRestIsKnownWithin7Ms) {
  const float off_A = 20.0f * magnitude(FakeBoard::kCurrent_A_per_count);
  EXPECT_EQ(pulse_a_rotor(0.0f).finding, Finding::slow);
  const Pulsed off = pulse_a_rotor(0.0f, 1.0f, {off_A, -off_A});
  EXPECT_EQ(off.finding, Finding::slow);
  EXPECT_LT(off.samples, 0.0070f * 24000.0f);
}

TEST(RotorFinder, ARotorTurningBackwardsSlowlyIsLeftToItsShortedWindings) {
  const FinderConfig c = configure<FakeBoard>(Parameters{}).finder;
  EXPECT_EQ(pulse_a_rotor(-0.9f * c.backward_e_rad_s).finding, Finding::slow);
  EXPECT_EQ(pulse_a_rotor(-1.1f * c.backward_e_rad_s).finding, Finding::found);
}

TEST(RotorFinder, ACurrentThatTheSpeedCannotInduceIsNoRotor) {
  EXPECT_EQ(pulse_a_rotor(8000.0f, 0.2f).finding, Finding::slow);
  EXPECT_EQ(pulse_a_rotor(8000.0f, 3.5f).finding, Finding::slow);
}

TEST(StartUp, MeasuresTheResistanceWithoutTheDeadTimesVoltage) {
  const StartConfig c = configure<FakeBoard>(Parameters{}).start;
  StartState s{MotorState::align, 0.0f, 0.0f, 1.0f};
  float measured = 0.0f;
  for (int k = 0; k < 4000 && s.phase == MotorState::align; ++k) {
    static float i = 0.0f;
    StartInputs in;
    in.along_A = i;
    in.along_V = 0.055f * i + 0.7f;  // 0.7 V of dead time that the firmware does not know
    const StartStep out = step(c, s, in);
    i = out.current_A;
    if (out.resistance_ohm > 0.0f) measured = out.resistance_ohm;
  }
  EXPECT_NEAR(measured, 0.055f, 1e-4f);
}

TEST(StartUp, GivesUpWhenNothingLocks) {
  const StartConfig c = configure<FakeBoard>(Parameters{}).start;
  StartState s{MotorState::ramp, 0.0f, 0.0f, -1.0f};
  bool failed = false;
  int ticks = 0;
  for (; ticks < 4000 && !failed; ++ticks) failed = step(c, s, {}).failed;
  EXPECT_TRUE(failed);
  EXPECT_LT(static_cast<float>(ticks) * c.tick_s, 0.3f);
  EXPECT_LT(s.speed_rad_s, 0.0f);  // in the direction asked
}

// Of a board without a motor.
Parameters untested() {
  Parameters p;
  p.self_test = false;
  return p;
}

TEST(Motor, EveryInterruptOfAFreshBoardKeepsTheBridgeOffUntilCalibrated) {
  FakeBoard board;
  board.counts = {{2553, 2553, 2553}, 2000, 1740};
  Motor<FakeBoard> motor{untested()};
  motor.set_setpoint({Mode::speed, 500.0f});
  for (int k = 0; k < 250; ++k) {
    motor.on_sample(board);
    ASSERT_FALSE(board.bridge);
  }
  for (int k = 0; k < 50; ++k) motor.on_sample(board);
  EXPECT_TRUE(board.bridge);
}

TEST(Motor, TripsInTheVeryInterruptThatSeesTheCurrent) {
  FakeBoard board;
  board.counts = {{2553, 2553, 2553}, 2000, 1740};
  Motor<FakeBoard> motor{untested()};
  motor.set_setpoint({Mode::speed, 500.0f});
  for (int k = 0; k < 300; ++k) motor.on_sample(board);
  ASSERT_TRUE(board.bridge);
  board.counts.phase = {static_cast<std::uint16_t>(2553 - 1600), 2553 + 800, 2553 + 800};  // 47 A
  motor.on_sample(board);
  EXPECT_FALSE(board.bridge);
  EXPECT_EQ(motor.telemetry().fault, Fault::overcurrent);
  EXPECT_EQ(motor.counters().overcurrent_trips, 1u);
}

TEST(FakeBoard, FlashBehavesAsFlash) {
  FakeBoard b;
  EXPECT_TRUE(b.flash_program(0, 8, 0x1122334455667788u));
  EXPECT_FALSE(b.flash_program(0, 8, 0));  // not erased
  EXPECT_FALSE(b.flash_program(0, 4, 0));  // not a word boundary
  EXPECT_FALSE(b.flash_program(3, 0, 0));
  std::array<std::uint8_t, 2> out{};
  EXPECT_TRUE(b.flash_read(0, 8, out));
  EXPECT_EQ(out[0], 0x88);
  EXPECT_FALSE(b.flash_read(0, FakeBoard::kFlashPageBytes - 1, out));
  EXPECT_TRUE(b.flash_erase(0));
  EXPECT_TRUE(b.flash_program(0, 8, 1));
}

}  // namespace
