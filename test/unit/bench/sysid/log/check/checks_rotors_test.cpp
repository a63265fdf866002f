// Rotor speeds against what the vehicle did: a rotor scaled for a part of the flight, columns exchanged, a scale near the limit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using testing::find;
using ::testing::HasSubstr;
using testing::kAlways_s;
using ::testing::Not;

class ScaledRotor : public ::testing::TestWithParam<std::size_t> {
 protected:
  AnalyticFlight flight = analytic_flight();
  std::size_t rotor = GetParam();
  std::string name = "rotor " + std::to_string(GetParam() + 1) + " speed";
  void scale(double factor, double from_s, double to_s) {
    change(flight.record.rotor_omega_rad_s, from_s, to_s, [&](RotorValues& w) { w[rotor] *= factor; });
  }
  CheckedFlight checked() const { return check_flight(flight.record, flight.vehicle); }
};
INSTANTIATE_TEST_SUITE_P(Rotors, ScaledRotor, ::testing::Range<std::size_t>(0, 4));

TEST_P(ScaledRotor, ForThreeSecondsIsExcludedThereWithItsFactor) {
  for (const double factor : {0.7, 0.85, 1.2}) {
    flight = analytic_flight();
    scale(factor, 106.0, 109.0);
    const CheckedFlight c = checked();
    ASSERT_FALSE(c.refusal) << findings_table(c);
    const LogFinding* f = find(c, name, FindingAction::exclude, "times its speed");
    ASSERT_NE(f, nullptr) << findings_table(c);
    EXPECT_LE(f->from_s, 106.02) << factor;
    EXPECT_GE(f->to_s, 108.98) << factor;
    EXPECT_NEAR(f->from_s, 106.0, 0.4);
    EXPECT_NEAR(f->to_s, 109.0, 0.4);
    EXPECT_NEAR(std::stod(f->what.substr(f->what.find("reads ") + 6)), factor, 0.06);
    EXPECT_EQ(c.segments.size(), 2u) << findings_table(c);
  }
}

TEST_P(ScaledRotor, FromTheMiddleOnIsFoundFromThere) {
  for (const double factor : {0.8, 0.9}) {
    flight = analytic_flight();
    scale(factor, 108.5, kAlways_s);
    const CheckedFlight c = checked();
    const LogFinding* f = find(c, name, FindingAction::exclude, "times its speed");
    if (!f) f = find(c, name, FindingAction::refuse, "times its speed");
    ASSERT_NE(f, nullptr) << findings_table(c);
    EXPECT_NEAR(f->from_s, 108.5, 0.4) << findings_table(c);
    EXPECT_NEAR(f->to_s, 116.0, 0.6) << findings_table(c);
  }
}

TEST_P(ScaledRotor, ForTheLargerPartOfTheFlightIsRefused) {
  scale(0.8, 105.0, kAlways_s);
  const CheckedFlight c = checked();
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_NE(find(c, name, FindingAction::refuse, "times its speed"), nullptr) << findings_table(c);
}

TEST_P(ScaledRotor, ByLessThanTheLimitIsLeftAlone) {
  scale(0.97, 108.0, kAlways_s);
  const CheckedFlight c = checked();
  for (const LogFinding& f : c.findings) EXPECT_EQ(f.action, FindingAction::note) << findings_table(c);
}

TEST_P(ScaledRotor, ByATenthAllTheTimeIsRefusedWithTheLimitThatIsTestedAndWithoutPolePairs) {
  scale(0.9, 0.0, kAlways_s);
  const CheckedFlight c = checked();
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_NE(find(c, name, FindingAction::refuse, "(allowed 0.930 to 1.070)"), nullptr) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, Not(HasSubstr("pole pairs")));
}

// Thrust of a flight whose centre of mass is 3.6 mm off in x and in y, of arms of 80 mm, and whose yaw is trimmed besides: on the mean of
// hover all three axes then agree on one rotor, as if it read 1.08 times its speed.
TEST_P(ScaledRotor, IsNotBlamedForACentreOfMassOffTheMiddleAndAYawTrim) {
  const auto signs = [&](std::size_t k) {
    const Eigen::Vector3d& hub = flight.vehicle.rotors[k].position_m;
    return Eigen::Vector3d(std::copysign(1.0, hub.y()), std::copysign(1.0, hub.x()), flight.vehicle.rotors[k].reaction);
  };
  const Eigen::Vector3d off = 0.045 * signs(rotor).cwiseProduct(Eigen::Vector3d(1.0, 1.0, 0.7));
  for (RotorValues& w : flight.record.rotor_omega_rad_s.value) {
    double sum = 0.0;
    for (const double x : w) sum += x * x;
    for (std::size_t k = 0; k < 4; ++k) w[k] = std::sqrt(w[k] * w[k] + 0.25 * sum * off.dot(signs(k)));
  }
  const CheckedFlight c = checked();
  EXPECT_FALSE(c.refusal) << findings_table(c);
  EXPECT_NE(find(c, "rotor speeds", FindingAction::note, "a centre of mass"), nullptr) << findings_table(c);
}

TEST(RotorAtItsLowerLimit, For55MillisecondsIsNoFaultOfItsSensor) {
  for (std::size_t rotor = 0; rotor < 4; ++rotor) {
    AnalyticFlight f = analytic_flight();
    change(f.record.rotor_omega_rad_s, 107.0, 107.055, [&](RotorValues& w) { w[rotor] = 300.0; });
    const CheckedFlight c = check_flight(f.record, f.vehicle);
    EXPECT_EQ(find(c, "rotor " + std::to_string(rotor + 1) + " speed", FindingAction::exclude), nullptr) << findings_table(c);
    EXPECT_EQ(c.segments.size(), 1u) << findings_table(c);
  }
}

FlightRecord slipped_by_one(FlightRecord f, double from_s, double to_s) {
  change(f.rotor_omega_rad_s, from_s, to_s, [](RotorValues& w) { w = {w[3], w[0], w[1], w[2]}; });
  return f;
}

// The stamp within a span at which the speeds of neighbouring columns differ most: where they are equal no slip shows.
double most_unlike_s(const Stream<RotorValues>& w, double from_s, double to_s) {
  double at_s = from_s, most = 0.0;
  for (std::size_t i = 0; i < w.size(); ++i) {
    double square = 0.0;
    for (std::size_t k = 0; k < 4; ++k) square += std::pow(w.value[i][k] - w.value[i][(k + 1) % 4], 2);
    if (w.t_s[i] >= from_s && w.t_s[i] <= to_s && square > most) {
      most = square;
      at_s = w.t_s[i];
    }
  }
  return at_s;
}

TEST(SlippedColumns, AreRefusedWithTheSampleInTheMiddleAndWithinTheLastSecond) {
  const AnalyticFlight a = analytic_flight();
  for (const double around_s : {108.0, 115.0}) {
    const double from_s = most_unlike_s(a.record.rotor_omega_rad_s, around_s, around_s + 0.8);
    const CheckedFlight c = check_flight(slipped_by_one(a.record, from_s, kAlways_s), a.vehicle);
    ASSERT_TRUE(c.refusal) << from_s;
    const LogFinding* f = find(c, stream_name::rotors, FindingAction::refuse, "one place further on");
    ASSERT_NE(f, nullptr) << findings_table(c);
    EXPECT_NEAR(f->from_s, from_s, 0.01);
  }
}

TEST(SlippedColumns, ForOneSampleAloneAreNoSlip) {
  const AnalyticFlight a = analytic_flight();
  const CheckedFlight c = check_flight(slipped_by_one(a.record, 108.0, 108.001), a.vehicle);
  EXPECT_FALSE(c.refusal) << findings_table(c);
}

TEST(ExchangedRotors, AreRefusedWithTheColumnsToExchange) {
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) {
      AnalyticFlight f = analytic_flight();
      change(f.record.rotor_omega_rad_s, 0.0, kAlways_s, [&](RotorValues& w) { std::swap(w[a], w[b]); });
      const CheckedFlight c = check_flight(f.record, f.vehicle);
      ASSERT_TRUE(c.refusal) << findings_table(c);
      EXPECT_NE(find(c, "rotor speeds", FindingAction::refuse, "roll and pitch"), nullptr) << findings_table(c);
      EXPECT_THAT(c.refusal->likely,
                  HasSubstr("rotor " + std::to_string(a + 1) + " and rotor " + std::to_string(b + 1) + " are exchanged"));
    }
}

TEST(ExchangedRotors, OfAnotherNumberingAreRefusedWithTheColumnOfEach) {
  AnalyticFlight f = analytic_flight();  // clockwise from front right, as some flight controllers count
  change(f.record.rotor_omega_rad_s, 0.0, kAlways_s, [](RotorValues& w) { w = {w[0], w[3], w[1], w[2]}; });
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, HasSubstr("rotor 2 is in the column of rotor 3"));
}

}  // namespace
}  // namespace rotorloop::log
