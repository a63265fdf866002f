// What a user sets beside the speed loop: how a motor stops, tones, cells; and what happens to a thermistor, a late interrupt, and at other
// sampling rates than the 24 kHz that the core grew up with.
#include <gtest/gtest.h>

#include "bench/hil/esc_lab/rpm_loop.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::esc_lab;
using firmware::Blocked;
using firmware::Limiter;
using firmware::MotorState;
using firmware::StopMode;

NativeEsc at_9000_rpm(const firmware::Parameters& p, double bus_V = 15.2) {
  NativeEscConfig c;
  c.firmware = p;
  c.bus_V = bus_V;
  c.typical_board = true;  // its legs lose nothing to dead times while nothing switches; the simple bridge's do
  NativeEsc esc = make_esc(c);
  esc.set_setpoint(speed(9000 * kRpm));
  run_ms(esc, 900.0);
  EXPECT_NEAR(esc.omega_rad_s(), 9000 * kRpm, 10.0);
  return esc;
}

double ms_down_to(NativeEsc& esc, double rad_s) {
  double reached_ms = 1e9;
  run_ms(esc, 2000.0, [&](double ms) {
    if (reached_ms > 1e8 && esc.omega_rad_s() <= rad_s) reached_ms = ms;
  });
  return reached_ms;
}

firmware::Parameters stopping(StopMode mode, float strength) {
  firmware::Parameters p;
  p.stop_mode = mode;
  p.stop_strength = strength;
  return p;
}

TEST(Stops, BrakesFrom9000To2000RpmFasterThanCoastingAndFasterStillWithTwiceTheStrength) {
  double ms[3];
  int k = 0;
  for (const auto& p : {stopping(StopMode::coast, 0.3f), stopping(StopMode::brake, 0.2f), stopping(StopMode::brake, 0.4f)}) {
    NativeEsc esc = at_9000_rpm(p);
    esc.set_setpoint({});
    ms[k++] = ms_down_to(esc, 2000 * kRpm);
    EXPECT_FALSE(esc.board().bridge) << "at rest the bridge is off, coasting or having braked";
    EXPECT_EQ(esc.motor().counters().errors(), 0u);
  }
  std::printf("9 000 to 2 000 RPM: coast %.0f ms, brake 0.2 %.0f ms, brake 0.4 %.0f ms\n", ms[0], ms[1], ms[2]);
  EXPECT_LT(ms[1], 0.8 * ms[0]);
  EXPECT_LT(ms[2], 0.8 * ms[1]);
}

TEST(Stops, DragKeepsTheWindingsShortedUntilTheOrderEnds) {
  NativeEsc drag = at_9000_rpm(stopping(StopMode::drag, 0.3f)), brake = at_9000_rpm(stopping(StopMode::brake, 0.3f));
  for (NativeEsc* esc : {&drag, &brake}) {
    esc->set_setpoint({});
    run_ms(*esc, 2000.0);
    esc->drive().motor().state().omega_rad_s = 100.0;  // by the wind
    run_ms(*esc, 20.0);
  }
  EXPECT_EQ(drag.telemetry().state, MotorState::holding);
  EXPECT_LT(drag.omega_rad_s(), 0.8 * brake.omega_rad_s());
  drag.set_setpoint({firmware::Mode::speed, std::numeric_limits<float>::quiet_NaN()});  // nobody renews it
  run_ms(drag, 25.0);
  EXPECT_FALSE(drag.board().bridge);
}

TEST(Tones, ARotorAtRestSoundsAt1000HzWithoutTurningAndRefuses20Hz) {
  NativeEscConfig c;
  NativeEsc esc = make_esc(c);
  const double begin_rad = esc.drive().motor().state().angle_rad;
  esc.set_setpoint({firmware::Mode::tone, 1000.0f});
  int changes = 0;
  double last = 0.0;
  run_ms(esc, 500.0, [&](double) {
    const double u = esc.drive().phase_currents_A().u;
    if (std::fabs(u) > 0.2) {
      changes += last * u < 0.0;
      last = u;
    }
  });
  EXPECT_EQ(esc.telemetry().state, MotorState::tone);
  EXPECT_NEAR(changes, 1000, 20);
  EXPECT_LT(std::fabs(esc.omega_rad_s()), 20.0);
  EXPECT_LT(std::fabs(esc.drive().motor().state().angle_rad - begin_rad), 0.5);
  esc.set_setpoint({firmware::Mode::tone, 20.0f});
  run_ms(esc, 50.0);
  EXPECT_FALSE(esc.board().bridge);
}

TEST(Cells, SixOfThemDerateBelow19V8AndStopBelow18VWhereTwelveVoltsWouldNot) {
  firmware::Parameters six;
  six.cells = 6;
  for (const bool by_cells : {true, false}) {
    NativeEsc esc = at_9000_rpm(by_cells ? six : firmware::Parameters{}, 22.0);
    esc.couple_quadratic(kTriblade_N_m_s2, 18.3);
    run_ms(esc, 50.0);
    std::set<Limiter> limiters;
    esc.set_setpoint(speed(13000 * kRpm));
    run_ms(esc, 100.0, [&](double) { limiters.insert(esc.telemetry().limiter); });
    EXPECT_EQ(limiters.contains(Limiter::undervoltage), by_cells);
    esc.couple_quadratic(kTriblade_N_m_s2, 17.5);
    run_ms(esc, 20.0);
    EXPECT_EQ(esc.telemetry().blocked == Blocked::undervoltage, by_cells);
    EXPECT_EQ(esc.board().bridge, !by_cells);
  }
}

class Thermistor : public testing::TestWithParam<sim::DriveFaultKind> {};

TEST_P(Thermistor, LostInFlightCostsHalfTheCurrentAndIsReported) {
  double peak_A[2] = {0.0, 0.0};
  for (const int broken : {0, 1}) {
    NativeEsc esc = at_9000_rpm({});
    if (broken == 1) esc.drive().add_fault({.kind = GetParam(), .from_s = esc.drive().time_s()});
    run_ms(esc, 20.0);
    EXPECT_EQ(esc.telemetry().temperature_valid, broken == 0);
    EXPECT_EQ(esc.motor().counters().thermistor_lost, static_cast<std::uint32_t>(broken));
    esc.set_setpoint(speed(12000 * kRpm));
    run_ms(esc, 100.0, [&](double) { peak_A[broken] = std::max(peak_A[broken], std::fabs(esc.drive().motor().state().i_q_A)); });
    EXPECT_EQ(esc.telemetry().state, MotorState::running);
  }
  EXPECT_GT(peak_A[0], 33.0);
  EXPECT_LT(peak_A[1], 0.5 * 40.0 + 2.0);
}

TEST_P(Thermistor, LostOnTheGroundRefusesTheStartUntilItReadsAgain) {
  NativeEscConfig c;
  NativeEsc esc(c);
  esc.couple_quadratic(kTriblade_N_m_s2, c.bus_V);
  esc.drive().add_fault({.kind = GetParam(), .from_s = 0.0, .until_s = 0.2});
  run_ms(esc, 30.0);
  esc.set_setpoint(speed(3000 * kRpm));
  run_ms(esc, 150.0, [&](double) { ASSERT_FALSE(esc.board().bridge); });
  EXPECT_EQ(esc.telemetry().blocked, Blocked::temperature_sensor);
  run_ms(esc, 820.0);
  EXPECT_NEAR(esc.omega_rad_s(), 3000 * kRpm, 10.0);
}
INSTANTIATE_TEST_SUITE_P(OpenAndShort, Thermistor, testing::Values(sim::DriveFaultKind::ntc_open, sim::DriveFaultKind::ntc_short));

// The board of the reference at other rates: 48 kHz is every PWM period, 12 kHz every second one of 24 kHz.
template <std::uint32_t kPwm, std::uint32_t kPeriods>
struct Sampled : firmware::B_G431B_ESC1_Scales {
  static constexpr std::uint32_t kPwm_Hz = kPwm, kPwmPeriodsPerSample = kPeriods;
  static constexpr std::uint32_t kPwmTop = 85'000'000 / kPwm;
};
using Sampled48kHz = Sampled<48'000, 1>;
using Sampled24kHz = Sampled<48'000, 2>;
using Sampled12kHz = Sampled<24'000, 2>;

sim::DriveParameters at_pwm(double pwm_Hz) {
  sim::DriveParameters d;
  d.inverter.pwm_Hz = pwm_Hz;
  return d;
}

// The true drive with the motor control at that rate.
template <class Scales>
class SampledEsc {
 public:
  using Board = firmware::BasicFakeBoard<Scales>;
  explicit SampledEsc(const firmware::Parameters& p) : drive_(at_pwm(Scales::kPwm_Hz), RandomStream(5, 1), 1.0), motor_(p) {
    drive_.set_bus_V(15.2);
    drive_.set_load({kTriblade_N_m_s2, 0.0});
  }
  void step() {
    const sim::AdcReading r = drive_.sample();
    const firmware::PwmCompare active = board_.compare;
    board_.counts = {r.phase, r.bus, r.temperature};
    board_.now_us = static_cast<std::uint64_t>(1e6 * drive_.time_s()) + delay_us;
    motor_.set_setpoint(order);
    motor_.on_sample(board_);
    for (std::uint32_t k = 0; k < Board::kPwmPeriodsPerSample; ++k)
      drive_.step({active.phase, static_cast<std::uint16_t>(Board::kPwmTop), board_.bridge, board_.gates});
  }
  template <class Each>
  void run_s(double seconds, const Each& each) {
    const double begin_s = drive_.time_s();
    while (drive_.time_s() < begin_s + seconds) {
      step();
      each(1e3 * (drive_.time_s() - begin_s));
    }
  }
  double rpm() const { return drive_.omega_rad_s() / kRpm; }
  firmware::Motor<Board>& motor() { return motor_; }
  Board& board() { return board_; }
  firmware::Setpoint order{};
  std::uint64_t delay_us = 0;

 private:
  sim::Drive drive_;
  Board board_{};
  firmware::Motor<Board> motor_;
};

template <class Scales>
void starts_and_steps() {
  firmware::Parameters p;
  const double top_rad_s = 0.999 * static_cast<double>(firmware::usable_speed_e_rad_s<firmware::BasicFakeBoard<Scales>>()) / p.pole_pairs;
  p.max_speed_rad_s = static_cast<float>(std::min(1780.0, top_rad_s));
  SampledEsc<Scales> esc(p);
  esc.run_s(0.03, [](double) {});
  esc.order = speed(2000 * kRpm);
  double started_ms = 1e9;
  esc.run_s(0.9, [&](double ms) {
    if (started_ms > 1e8 && esc.rpm() >= 1960.0) started_ms = ms;
  });
  EXPECT_LE(started_ms, 600.0);
  esc.order = speed(6800 * kRpm);
  esc.run_s(0.6, [](double) {});
  esc.order = speed(10200 * kRpm);
  StepMeter meter(6800.0, 10200.0);
  esc.run_s(0.3, [&](double ms) { meter.add(ms, esc.rpm()); });
  std::printf("sampled at %u Hz: start %.0f ms, rise %.1f ms, settle %.1f ms, overshoot %.1f %%\n",
              Scales::kPwm_Hz / Scales::kPwmPeriodsPerSample, started_ms, meter.rise_ms(), meter.settle_ms(), meter.overshoot_percent());
  EXPECT_LE(meter.rise_ms(), 35.0);
  EXPECT_LE(meter.settle_ms(), 70.0);
  EXPECT_LE(meter.overshoot_percent(), 5.0);
  EXPECT_EQ(esc.motor().counters().errors(), 0u);
}

TEST(Sampling, At48kHzItStartsIn600msAndStepsWithinTheLimitsOf24kHz) { starts_and_steps<Sampled48kHz>(); }
TEST(Sampling, At12kHzItStartsIn600msAndStepsWithinTheLimitsOf24kHz) { starts_and_steps<Sampled12kHz>(); }

TEST(Sampling, At12kHzAMaxSpeedBeyondSevenSamplesATurnIsRefusedWithTheReasonAndNothingTurns) {
  firmware::Parameters p;  // 17 000 RPM and 7 pole pairs are 119 000 electrical RPM; 12 kHz hold 102 857
  SampledEsc<Sampled12kHz> esc(p);
  EXPECT_EQ(esc.motor().config().problem, firmware::ParameterProblem::speed_beyond_sampling);
  esc.order = speed(2000 * kRpm);
  esc.run_s(0.3, [&](double) { ASSERT_FALSE(esc.board().bridge); });
  EXPECT_EQ(esc.motor().telemetry().blocked, Blocked::parameters);
}

TEST(Sampling, AnInterruptThatComesALateSampleIsCountedOnce) {
  SampledEsc<Sampled24kHz> esc({});
  esc.run_s(0.1, [](double) {});
  EXPECT_EQ(esc.motor().counters().interrupts_late, 0u);
  esc.delay_us = 42;
  esc.run_s(0.1, [](double) {});
  EXPECT_EQ(esc.motor().counters().interrupts_late, 1u);
}

}  // namespace
