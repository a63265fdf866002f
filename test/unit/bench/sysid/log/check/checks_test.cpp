// Faults of known place and size, put into a clean flight: each is found where it is, named for what it is, and taken out or refused.
#include "bench/sysid/log/check/checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "test/unit/bench/sysid/estimate/analytic_flight.hpp"
#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::find;
using ::testing::HasSubstr;

constexpr double kStart_s = 100.0;

const AnalyticFlight& made_once(int seed) {
  static std::map<int, AnalyticFlight> flights;
  const auto [at, is_new] = flights.try_emplace(seed);
  if (is_new) at->second = analytic_flight(static_cast<std::uint64_t>(seed));
  return at->second;
}

// The flight with a fault in it, and its seed's own place for the fault.
class Fault : public ::testing::TestWithParam<int> {
 protected:
  std::uint64_t seed() const { return static_cast<std::uint64_t>(GetParam()); }
  AnalyticFlight flight = made_once(GetParam());
  RandomStream random{static_cast<std::uint64_t>(GetParam()), 99};
  double at_s = kStart_s + 2.0 + 11.0 * random.uniform(0);                // where the fault begins
  std::size_t which = static_cast<std::size_t>(4.0 * random.uniform(1));  // rotor
  std::size_t axis = static_cast<std::size_t>(3.0 * random.uniform(2));
  CheckedFlight checked() const { return check_flight(flight.record, flight.vehicle); }

  template <class Value, class Change>
  static void change(Stream<Value>& s, double from_s, double to_s, Change&& to) {
    for (std::size_t i = 0; i < s.size(); ++i)
      if (s.t_s[i] >= from_s && s.t_s[i] <= to_s) to(s.value[i]);
  }
  static void expect_found(const CheckedFlight& c, const std::string& stream, FindingAction action, const std::string& words, double from_s,
                           double to_s, double within_s) {
    const LogFinding* f = find(c, stream, action, words);
    ASSERT_NE(f, nullptr) << "no finding on " << stream << " with '" << words << "' in\n" << findings_table(c);
    EXPECT_NEAR(f->from_s, from_s, within_s) << findings_table(c);
    EXPECT_NEAR(f->to_s, to_s, within_s) << findings_table(c);
  }
  void expect_refused(const std::string& stream, const std::string& likely) const {
    const CheckedFlight c = checked();
    ASSERT_TRUE(c.refusal) << findings_table(c);
    EXPECT_NE(find(c, stream, FindingAction::refuse), nullptr) << findings_table(c);
    EXPECT_THAT(c.refusal->likely, HasSubstr(likely)) << findings_table(c);
    EXPECT_FALSE(c.refusal->remedy.empty());
  }
};
INSTANTIATE_TEST_SUITE_P(Seeds, Fault, ::testing::Range(1, 3));

TEST_P(Fault, AbsentThenNothingIsExcludedAndAllSecondsAreKept) {
  const CheckedFlight c = checked();
  for (const LogFinding& f : c.findings) EXPECT_EQ(f.action, FindingAction::note) << findings_table(c);
  ASSERT_EQ(c.segments.size(), 1u);
  EXPECT_NEAR(c.segments[0].span_s(), 16.0, 0.02);
  EXPECT_EQ(c.flight.gyro_B_rad_s.size(), flight.record.gyro_B_rad_s.size());
}

TEST_P(Fault, RotorThatReadsZeroForHalfASecondIsExcludedToATwentiethOfASecond) {
  change(flight.record.rotor_omega_rad_s, at_s, at_s + 0.5, [&](RotorValues& w) { w[which] = 0.0; });
  const CheckedFlight c = checked();
  expect_found(c, "rotor " + std::to_string(which + 1) + " speed", FindingAction::exclude, "less than a fifth", at_s, at_s + 0.5, 0.05);
  ASSERT_EQ(c.segments.size(), 2u) << findings_table(c);
  for (const RotorValues& w : c.flight.rotor_omega_rad_s.value) EXPECT_GT(w[which], 0.0);
}

TEST_P(Fault, RotorThatReadsHalfItsSpeedForASecondIsExcludedAndTheFactorIsTold) {
  change(flight.record.rotor_omega_rad_s, at_s, at_s + 1.0, [&](RotorValues& w) { w[which] *= 0.5; });
  expect_found(checked(), "rotor " + std::to_string(which + 1) + " speed", FindingAction::exclude, "times the middle of the others", at_s,
               at_s + 1.0, 0.1);
}

TEST_P(Fault, RotorThatReadsZeroMostOfTheFlightIsRefusedWithItsTimes) {
  change(flight.record.rotor_omega_rad_s, 101.0, 115.0, [&](RotorValues& w) { w[which] = 0.0; });
  const CheckedFlight c = checked();
  ASSERT_TRUE(c.refusal) << findings_table(c);
  expect_found(c, "rotor " + std::to_string(which + 1) + " speed", FindingAction::refuse, "", 101.0, 115.0, 0.05);
  try {
    c.throw_if_refused();
    FAIL() << "not thrown";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
  }
}

TEST_P(Fault, RotorWithSixPolePairsCountedAsSevenIsRefusedByNameAndRatio) {
  change(flight.record.rotor_omega_rad_s, 0.0, 1e9, [&](RotorValues& w) { w[which] *= 6.0 / 7.0; });
  expect_refused("rotor " + std::to_string(which + 1) + " speed", "6 pole pairs counted as 7");
}

TEST_P(Fault, CentreOfMassOffTheMiddleIsNoScaledRotor) {
  // 6 mm forward: the front pair carries more, as a true rotor model would have it.
  for (RotorValues& w : flight.record.rotor_omega_rad_s.value) {
    for (const std::size_t front : {0u, 2u}) w[front] *= std::sqrt(1.0 + 0.006 / 0.08);
    for (const std::size_t rear : {1u, 3u}) w[rear] *= std::sqrt(1.0 - 0.006 / 0.08);
  }
  EXPECT_FALSE(checked().refusal) << findings_table(checked());
}

TEST_P(Fault, SpeedsInRevolutionsPerMinuteAreRefusedWithTheUnit) {
  change(flight.record.rotor_omega_rad_s, 0.0, 1e9, [](RotorValues& w) {
    for (double& x : w) x *= 30.0 / std::numbers::pi;
  });
  expect_refused("rotor speeds", "rev/min");
}

TEST_P(Fault, ElectricalSpeedsOfSevenPolePairsAreRefusedWithThePolePairs) {
  change(flight.record.rotor_omega_rad_s, 0.0, 1e9, [](RotorValues& w) {
    for (double& x : w) x *= 7.0;
  });
  expect_refused("rotor speeds", "7 pole pairs");
}

TEST_P(Fault, SpikesOfOneSampleAreTakenOutAndNothingElse) {
  auto& w = flight.record.rotor_omega_rad_s;
  for (std::size_t n = 0; n < 10; ++n) w.value[400 + 700 * n][which] += n % 2 ? 1700.0 : 900.0;
  const CheckedFlight c = checked();
  expect_found(c, "rotor speeds", FindingAction::exclude, "10 samples spike", w.t_s[400], w.t_s[400 + 6300], 1e-6);
  EXPECT_EQ(c.flight.rotor_omega_rad_s.size(), w.size() - 10);
  EXPECT_EQ(c.segments.size(), 1u);
}

TEST_P(Fault, RotorThatFreezesWhileTheOthersChangeIsExcluded) {
  double held = 0.0;
  change(flight.record.rotor_omega_rad_s, at_s, at_s + 0.8, [&](RotorValues& w) {
    held = held > 0.0 ? held : w[which];
    w[which] = held;
  });
  expect_found(checked(), "rotor " + std::to_string(which + 1) + " speed", FindingAction::exclude, "stands at", at_s, at_s + 0.8, 0.01);
}

TEST_P(Fault, GyroAxisThatFreezesIsExcluded) {
  change(flight.record.gyro_B_rad_s, at_s, at_s + 0.6, [&](Eigen::Vector3d& w) { w[static_cast<int>(axis)] = 0.123; });
  expect_found(checked(), std::string("gyro ") + "xyz"[axis], FindingAction::exclude, "stands at", at_s, at_s + 0.6, 0.01);
}

TEST_P(Fault, PoseThatFreezesWhileTheVehicleMovesIsExcluded) {
  const PoseReading* held = nullptr;
  change(flight.record.pose, at_s, at_s + 0.4, [&](PoseReading& p) { held ? p = *held : *(held = &p); });
  expect_found(checked(), "pose", FindingAction::exclude, "repeats one reading", at_s, at_s + 0.4, 0.02);
}

TEST_P(Fault, BatteryThatIsAConstantIsLeftOut) {
  change(flight.record.battery_V, 0.0, 1e9, [](double& v) { v = 15.2; });
  const CheckedFlight c = checked();
  EXPECT_NE(find(c, "battery", FindingAction::exclude, "15.200 V"), nullptr) << findings_table(c);
  EXPECT_TRUE(c.flight.battery_V.empty());
}

TEST_P(Fault, AccelerometerAtTheEndOfItsRangeIsExcluded) {
  std::size_t beyond = 0;
  change(flight.record.accel_B_m_s2, 0.0, 1e9, [&](Eigen::Vector3d& f) {
    if (f.z() > 16.0) {
      f.z() = 16.0;
      ++beyond;
    }
  });
  ASSERT_GT(beyond, 20u);
  EXPECT_NE(find(checked(), "accelerometer", FindingAction::exclude, "end of its range, 16 m/s^2"), nullptr) << findings_table(checked());
}

TEST_P(Fault, PoseThatJumpsAndStaysIsSplitWhereItJumps) {
  change(flight.record.pose, at_s, 1e9, [&](PoseReading& p) { p.p_W_m[static_cast<int>(axis)] += 0.7; });
  const CheckedFlight c = checked();
  expect_found(c, "pose", FindingAction::exclude, "jumps by", at_s, at_s, 0.02);
  ASSERT_EQ(c.segments.size(), 2u) << findings_table(c);
}

TEST_P(Fault, AttitudeThatTurnsAtOnceKeepsTheLongerPart) {
  change(flight.record.pose, at_s, 1e9,
         [&](PoseReading& p) { p.q_WS = p.q_WS * Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())); });
  const CheckedFlight c = checked();
  ASSERT_EQ(c.segments.size(), 1u) << findings_table(c);
  EXPECT_NEAR(c.segments[0].span_s(), std::max(at_s - kStart_s, kStart_s + 16.0 - at_s), 0.05);
}

TEST_P(Fault, RepeatedAndBackwardStampsAreDroppedAndCounted) {
  auto& g = flight.record.gyro_B_rad_s;
  g.t_s[1000] = g.t_s[999];
  g.t_s[3000] = g.t_s[2900] + 0.0005;
  g.t_s[5000] += 400.0;
  const CheckedFlight c = checked();
  EXPECT_NE(find(c, "gyro", FindingAction::exclude, "1 samples repeat"), nullptr) << findings_table(c);
  EXPECT_NE(find(c, "gyro", FindingAction::exclude, "2 samples out of order"), nullptr) << findings_table(c);
  EXPECT_EQ(c.flight.gyro_B_rad_s.size(), g.size() - 3);
}

TEST_P(Fault, GapIsNotedWithItsLengthAndEndsASegmentWhenRotorSpeedsAreMissing) {
  auto& w = flight.record.rotor_omega_rad_s;
  Stream<RotorValues> holed;
  for (std::size_t i = 0; i < w.size(); ++i)
    if (w.t_s[i] < at_s || w.t_s[i] > at_s + 0.3) holed.add(w.t_s[i], w.value[i]);
  w = holed;
  const CheckedFlight c = checked();
  expect_found(c, "rotor speeds", FindingAction::note, "1 gaps", at_s, at_s + 0.3, 0.005);
  EXPECT_EQ(c.segments.size(), 2u);
}

TEST_P(Fault, ValuesThatAreNoNumbersAreDropped) {
  flight.record.accel_B_m_s2.value[77].y() = std::numeric_limits<double>::quiet_NaN();
  flight.record.rotor_omega_rad_s.value[78][which] = std::numeric_limits<double>::quiet_NaN();
  const CheckedFlight c = checked();
  EXPECT_NE(find(c, "accelerometer", FindingAction::exclude, "1 of 8001 samples are no numbers"), nullptr) << findings_table(c);
  const LogFinding* hole = find(c, "rotor speeds", FindingAction::exclude, "1 of 8001 samples are no numbers");
  ASSERT_NE(hole, nullptr) << findings_table(c);
  EXPECT_FALSE(hole->fault) << "one reading that is not known";
}

TEST_P(Fault, ALastingHoleWithinAStreamIsAFault) {
  auto& gyro = flight.record.gyro_B_rad_s;
  for (std::size_t i = 4000; i < 4000 + 80; ++i) gyro.value[i].x() = std::numeric_limits<double>::quiet_NaN();
  const double gap_s = gyro.t_s[4080] - gyro.t_s[3999];
  ASSERT_GT(gap_s, CheckLimits{}.longest_rotor_gap_s);
  const CheckedFlight c = checked();
  const LogFinding* hole = find(c, "gyro", FindingAction::exclude, "80 of 8001 samples are no numbers");
  ASSERT_NE(hole, nullptr) << findings_table(c);
  EXPECT_TRUE(hole->fault);
}

TEST_P(Fault, BlanksBeforeTheFirstReadingAndAfterTheLastAreLeftOutAndNoFault) {
  auto& gyro = flight.record.gyro_B_rad_s;
  for (std::size_t i = 0; i < 40; ++i) gyro.value[i].x() = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = gyro.size() - 7; i < gyro.size(); ++i) gyro.value[i].z() = std::numeric_limits<double>::quiet_NaN();
  const CheckedFlight c = checked();
  const LogFinding* before = find(c, "gyro", FindingAction::exclude, "40 of 8001 samples before its first reading");
  const LogFinding* after = find(c, "gyro", FindingAction::exclude, "7 of 8001 samples after its last reading");
  ASSERT_TRUE(before && after) << findings_table(c);
  EXPECT_FALSE(before->fault);
  EXPECT_FALSE(after->fault);
  EXPECT_EQ(c.flight.gyro_B_rad_s.size(), gyro.size() - 47);
}

TEST_P(Fault, GyroInDegreesPerSecondIsRefusedWithTheUnit) {
  change(flight.record.gyro_B_rad_s, 0.0, 1e9, [](Eigen::Vector3d& w) { w *= 180.0 / std::numbers::pi; });
  expect_refused("gyro", "deg/s");
}

TEST_P(Fault, GyroInForwardRightDownIsRefusedWithItsAxes) {
  change(flight.record.gyro_B_rad_s, 0.0, 1e9, [](Eigen::Vector3d& w) { w = {w.x(), -w.y(), -w.z()}; });
  expect_refused("gyro", "x, -y, -z");
}

TEST_P(Fault, GyroWithTwoAxesExchangedIsRefusedWithItsAxes) {
  change(flight.record.gyro_B_rad_s, 0.0, 1e9, [](Eigen::Vector3d& w) { w = {w.y(), -w.x(), w.z()}; });
  expect_refused("gyro", "y, -x, z");
}

TEST_P(Fault, AccelerometerInGravitiesIsRefusedWithTheUnit) {
  change(flight.record.accel_B_m_s2, 0.0, 1e9, [](Eigen::Vector3d& f) { f /= kGravity_m_s2; });
  expect_refused("accelerometer", "in g");
}

TEST_P(Fault, AccelerometerWithGravitysSignIsRefused) {
  change(flight.record.accel_B_m_s2, 0.0, 1e9, [](Eigen::Vector3d& f) { f = -f; });
  expect_refused("accelerometer", "sign");
}

TEST_P(Fault, AccelerometerWithoutGravityIsRefused) {
  change(flight.record.accel_B_m_s2, 0.0, 1e9, [](Eigen::Vector3d& f) { f.z() -= kGravity_m_s2; });
  expect_refused("accelerometer", "gravity was taken out");
}

TEST_P(Fault, QuaternionWithScalarLastReadAsFirstIsRefusedWithTheOrder) {
  change(flight.record.pose, 0.0, 1e9, [](PoseReading& p) { p.q_WS = Eigen::Quaterniond(p.q_WS.x(), p.q_WS.y(), p.q_WS.z(), p.q_WS.w()); });
  expect_refused("gyro", "stored x, y, z, w and read as w, x, y, z");
}

TEST_P(Fault, ConjugateQuaternionIsRefusedAsSuch) {
  change(flight.record.pose, 0.0, 1e9, [](PoseReading& p) { p.q_WS = p.q_WS.conjugate(); });
  expect_refused("gyro", "conjugate");
}

TEST_P(Fault, ConjugateQuaternionIsFoundByTiltAloneWithoutGyroAndAccelerometer) {
  flight.record.gyro_B_rad_s = {};
  flight.record.accel_B_m_s2 = {};
  change(flight.record.pose, 0.0, 1e9, [](PoseReading& p) { p.q_WS = p.q_WS.conjugate(); });
  const CheckedFlight c = checked();
  ASSERT_TRUE(c.refusal) << findings_table(c);
  EXPECT_THAT(c.refusal->likely, HasSubstr("conjugate"));
}

TEST_P(Fault, QuaternionThatChangesSignIsMadeContinuousAndNoted) {
  change(flight.record.pose, at_s, at_s + 1.0, [](PoseReading& p) { p.q_WS.coeffs() = -p.q_WS.coeffs(); });
  const CheckedFlight c = checked();
  EXPECT_FALSE(c.refusal) << findings_table(c);
  expect_found(c, "pose", FindingAction::note, "changed its sign 2 times", at_s, at_s + 1.0, 0.02);
  for (std::size_t i = 1; i < c.flight.pose.size(); ++i) EXPECT_GT(c.flight.pose.value[i].q_WS.dot(c.flight.pose.value[i - 1].q_WS), 0.9);
}

TEST_P(Fault, PositionInMillimetresIsRefusedWithTheUnit) {
  change(flight.record.pose, 0.0, 1e9, [](PoseReading& p) { p.p_W_m *= 1000.0; });
  flight.record.velocity_W_m_s = {};
  expect_refused("position", "in mm");
}

TEST_P(Fault, PositionWithAnAxisMirroredIsRefused) {
  change(flight.record.pose, 0.0, 1e9, [](PoseReading& p) { p.p_W_m.y() *= -1.0; });
  flight.record.velocity_W_m_s = {};
  expect_refused("position", "wrong sign");
}

TEST_P(Fault, VelocityInBodyAxesIsRefusedAsSuch) {
  const estimate::testing::AnalyticPath path(0.3 * static_cast<double>(seed()));
  auto& v = flight.record.velocity_W_m_s;
  const Eigen::Quaterniond heading(Eigen::AngleAxisd(1.4, Eigen::Vector3d::UnitZ()));  // a vehicle that flies looking aside
  for (auto& p : flight.record.pose.value) {
    p.q_WS = p.q_WS * heading;
    p.q_WS.normalize();
  }
  for (std::size_t i = 0; i < v.size(); ++i) v.value[i] = (path.attitude(v.t_s[i]) * heading).conjugate() * v.value[i];
  flight.record.gyro_B_rad_s = {};
  flight.record.accel_B_m_s2 = {};
  flight.record.rotor_omega_rad_s = {};
  expect_refused("velocity", "body axes");
}

TEST_P(Fault, StandingOnTheGroundBeforeAndAfterIsExcluded) {
  const AnalyticFlight& f = flight;
  const FlightRecord& r = f.record;
  // Three seconds at rest, rotors idling at a third of hover speed, put in front of the flight.
  FlightRecord ground;
  const PoseReading rest = r.pose.value.front();
  for (int i = 0; i < 1500; ++i) {
    const double t = 97.0 + 0.002 * i;
    const Eigen::Vector3d n(0.01 * random.gaussian(static_cast<std::uint64_t>(3 * i)),
                            0.01 * random.gaussian(static_cast<std::uint64_t>(3 * i + 1)), 0.0);
    ground.gyro_B_rad_s.add(t, n);
    ground.accel_B_m_s2.add(t, Eigen::Vector3d(0.0, 0.0, kGravity_m_s2) + n);
    ground.rotor_omega_rad_s.add(t, {330.0 + n.x(), 330.0 + n.y(), 331.0 - n.x(), 332.0 - n.y()});
    if (i % 5 == 0) ground.pose.add(t, {rest.p_W_m, Eigen::Quaterniond(1.0, 1e-3 * n.x(), 1e-3 * n.y(), 0.0).normalized()});
    if (i % 5 == 0) ground.velocity_W_m_s.add(t, n);
  }
  const auto append = [](auto& to, const auto& from) {
    for (std::size_t i = 0; i < from.size(); ++i) to.add(from.t_s[i], from.value[i]);
  };
  append(ground.pose, r.pose);
  append(ground.velocity_W_m_s, r.velocity_W_m_s);
  append(ground.gyro_B_rad_s, r.gyro_B_rad_s);
  append(ground.accel_B_m_s2, r.accel_B_m_s2);
  append(ground.rotor_omega_rad_s, r.rotor_omega_rad_s);
  const CheckedFlight c = check_flight(ground, f.vehicle);
  ASSERT_FALSE(c.refusal) << findings_table(c);
  expect_found(c, "flight", FindingAction::exclude, "on the ground", 97.0, 100.5, 0.3);
  for (const LogFinding& finding : c.findings) EXPECT_FALSE(finding.fault) << finding.what;
  ASSERT_FALSE(c.segments.empty());
  EXPECT_GE(c.flight.gyro_B_rad_s.t_s.front(), 100.0);
}

// --- offsets between streams ------------------------------------------------------------------------------------------

TEST_P(Fault, LatePoseIsToldToAFifthOfAMillisecond) {
  const double late_s = -0.03 + 0.07 * random.uniform(5);
  for (double& t : flight.record.pose.t_s) t += late_s;
  const CheckedFlight c = checked();
  const StreamOffset* o = c.offsets.find("pose", "gyro");
  ASSERT_NE(o, nullptr) << findings_table(c);
  EXPECT_NEAR(o->late_s, late_s, 2e-4);
  EXPECT_LT(o->u_s, 5e-4);
}

TEST_P(Fault, LateRotorSpeedsAreToldToHalfAMillisecond) {
  const double late_s = -0.02 + 0.06 * random.uniform(5);
  for (double& t : flight.record.rotor_omega_rad_s.t_s) t += late_s;
  const CheckedFlight c = checked();
  const StreamOffset* o = c.offsets.find("rotor speeds", "accelerometer");
  ASSERT_NE(o, nullptr) << findings_table(c);
  EXPECT_NEAR(o->late_s, late_s, 5e-4);
  const auto through = c.offsets.between("rotor speeds", "pose");
  ASSERT_TRUE(through);
  EXPECT_NEAR(through->late_s, late_s, 3e-3);
}

// --- output -----------------------------------------------------------------------------------------------------------

TEST(Findings, TableHasOneLinePerFindingAndJsonTheSameFindings) {
  AnalyticFlight f = analytic_flight();
  f.record.gyro_B_rad_s.t_s[1000] = f.record.gyro_B_rad_s.t_s[999];
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  const std::string table = findings_table(c);
  EXPECT_THAT(table, HasSubstr("exclude  gyro"));
  EXPECT_THAT(table, HasSubstr("1 samples repeat the stamp of the one before"));
  const auto j = nlohmann::json::parse(findings_json(c));
  EXPECT_EQ(j.at("findings").size(), c.findings.size());
  EXPECT_EQ(j.at("offsets").size(), c.offsets.pairs.size());
  EXPECT_TRUE(j.at("refusal").is_null());
}

TEST(Findings, EmptyRecordIsRefusedNotCrashedOn) {
  const CheckedFlight c = check_flight(FlightRecord{}, analytic_flight().vehicle);
  ASSERT_TRUE(c.refusal);
  EXPECT_THAT(nlohmann::json::parse(findings_json(c)).at("refusal").at("what").get<std::string>(), HasSubstr("no part"));
}

}  // namespace
}  // namespace rotorloop::log
