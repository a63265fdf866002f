// Instruments that cannot be trusted, by holds made up here: no bus, no motor.
#include "bench/stand/run/instrument_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/unit/bench/stand/run/virtual_run.hpp"

namespace rotorloop {
namespace {

using stand_run::InstrumentCheck;
using stand_run::StepMeans;
using testing::AllOf;
using testing::HasSubstr;

constexpr double kTop_rad_s = 1400.0;

// A sound hold on the shipped virtual stand: c_t 1.9e-6, c_q 2.9e-8, 16 V, 70 % of the power at the shaft; readings scatter.
StepMeans hold_at(double omega_rad_s) {
  StepMeans s;
  s.wanted_rad_s = s.omega_rad_s = omega_rad_s;
  s.thrust_N = 1.9e-6 * omega_rad_s * omega_rad_s;
  s.torque_N_m = 2.9e-8 * omega_rad_s * omega_rad_s;
  s.voltage_V = s.esc_voltage_V = 16.0;
  s.current_A = s.esc_current_A = s.torque_N_m * omega_rad_s / (0.7 * 16.0);
  const auto about = [](double value, double spread) { return std::pair(value - 0.5 * spread, value + 0.5 * spread); };
  s.shown[stand::kThrustColumn] = about(s.thrust_N, 0.08);
  s.shown[stand::kTorqueColumn] = about(s.torque_N_m, 4e-3);
  s.shown[stand::kCurrentColumn] = about(s.current_A, 0.1);
  s.shown[stand::kIndependentColumn] = about(omega_rad_s, 0.3);
  return s;
}

std::string found_in(const modbus::StandSetup& setup, const std::vector<StepMeans>& holds, bool in_wind = false) {
  InstrumentCheck check(setup, kTop_rad_s, in_wind);
  std::string all;
  for (const StepMeans& s : holds) all += check.hold(s);
  return all;
}

TEST(InstrumentCheck, SoundHoldsUpToTheHighestSpeedAndBackAreTrusted) {
  EXPECT_EQ(
      found_in(test::virtual_setup(), {hold_at(0.0), hold_at(150.0), hold_at(700.0), hold_at(1000.0), hold_at(1400.0), hold_at(700.0)}),
      "");
}

TEST(InstrumentCheck, AThrustThatShows1900mNAndNothingElseFrom1000To1250RadPerSIsNamed) {
  StepMeans before = hold_at(1000.0), after = hold_at(1250.0);
  before.shown[stand::kThrustColumn] = after.shown[stand::kThrustColumn] = {1.9, 1.9};
  before.thrust_N = after.thrust_N = 1.9;
  EXPECT_THAT(found_in(test::virtual_setup(), {hold_at(700.0), before, after}),
              AllOf(HasSubstr("thrust: shows 1.9"), HasSubstr("from 1000 to 1250 rad/s")));
}

TEST(InstrumentCheck, ACoarseCurrentOf1ADigitsThatShowsTheSameAt1000And1050RadPerSIsTrusted) {
  StepMeans slow = hold_at(700.0), before = hold_at(1000.0), after = hold_at(1050.0);
  slow.shown[stand::kCurrentColumn] = {1.0, 2.0};
  before.shown[stand::kCurrentColumn] = after.shown[stand::kCurrentColumn] = {3.0, 3.0};
  EXPECT_EQ(found_in(test::virtual_setup(), {slow, before, after}), "");
}

TEST(InstrumentCheck, ChannelsThatShowATenthOrTenTimesAreNamedFrom980RadPerSOnAndNotBelow) {
  const std::pair<double StepMeans::*, const char*> channels[] = {{&StepMeans::thrust_N, "thrust: "},
                                                                  {&StepMeans::torque_N_m, "torque: "},
                                                                  {&StepMeans::voltage_V, "voltage: the supply shows"},
                                                                  {&StepMeans::current_A, "current: the supply shows"}};
  for (const auto& [channel, says] : channels)
    for (const double factor : {0.1, 10.0}) {
      StepMeans low = hold_at(970.0), high = hold_at(1250.0);
      low.*channel *= factor;
      high.*channel *= factor;
      EXPECT_EQ(found_in(test::virtual_setup(), {low}), "") << says << factor;
      EXPECT_THAT(found_in(test::virtual_setup(), {high}), HasSubstr(says)) << factor;
    }
}

TEST(InstrumentCheck, ATorqueOf17mNmThatWiresAndBearingsTake10mNmFromIsTrusted) {
  const modbus::StandSetup setup = test::virtual_setup();
  InstrumentCheck check(setup, 1047.0, false);  // a plan up to 10 000 rpm
  StepMeans s = hold_at(766.0);
  s.torque_N_m -= 0.01;
  EXPECT_EQ(check.hold(s), "");
}

TEST(InstrumentCheck, WithoutTheESCsCurrentATenthOrTenTimesOfItIsSeenByThePower) {
  for (const double factor : {0.1, 10.0}) {
    StepMeans s = hold_at(1250.0);
    s.esc_current_A = 0.0;
    s.current_A *= factor;
    EXPECT_THAT(found_in(test::virtual_setup(), {s}), HasSubstr("power: torque and speed make")) << factor;
  }
}

TEST(InstrumentCheck, AZeroOf5NOfAnUntaredCellIsNotTakenForThrust) {
  StepMeans rest = hold_at(0.0), loaded = hold_at(1250.0);
  rest.thrust_N = -5.0;
  loaded.thrust_N -= 5.0;
  EXPECT_EQ(found_in(test::virtual_setup(), {rest, loaded}), "");
  EXPECT_THAT(found_in(test::virtual_setup(), {hold_at(0.0),
                                               [] {
                                                 StepMeans s = hold_at(1250.0);
                                                 s.thrust_N = 0.2;
                                                 return s;
                                               }()}),
              HasSubstr("expected_c_t_N_s2"));
}

TEST(InstrumentCheck, AThrustOfNearlyNothingIsTrustedInAWindTunnelAndBehindAnObstacle) {
  StepMeans s = hold_at(1250.0);
  s.thrust_N = 0.02;
  EXPECT_EQ(found_in(test::virtual_setup(), {s}, true), "");
  s.configuration = 'B';
  EXPECT_EQ(found_in(test::virtual_setup(), {s}), "");
}

TEST(InstrumentCheck, WithoutExpectedCoefficientsAPropellerOfTwiceTheTypicalThrustIsTrustedAndATenthIsNot) {
  modbus::StandSetup setup = test::virtual_setup();
  setup.expected_c_t_N_s2 = setup.expected_c_q_N_m_s2 = 0.0;  // typical of 0.127 m: 9.5e-7 and 9.6e-9
  EXPECT_EQ(found_in(setup, {hold_at(1250.0)}), "");
  StepMeans s = hold_at(1250.0);
  s.thrust_N *= 0.05;
  EXPECT_THAT(found_in(setup, {s}), HasSubstr("a propeller of this diameter"));
}

}  // namespace
}  // namespace rotorloop
