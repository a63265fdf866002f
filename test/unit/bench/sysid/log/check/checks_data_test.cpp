// The checks on every measured flight of the data folder: known faults are found where they are, clean flights lose nothing.
#include <gtest/gtest.h>

#include <set>

#include "bench/sysid/log/check/checks.hpp"
#include "test/unit/bench/sysid/identify/measured_flights.hpp"

namespace rotorloop::log {
namespace {

using identify::testing::flights_of;
using identify::testing::measured_flights;
using identify::testing::MeasuredFlight;
using identify::testing::read_measured;

class MeasuredLogs : public ::testing::Test {
 protected:
  void SetUp() override {
    if (measured_flights().empty()) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  }
  static CheckedFlight check(const std::filesystem::path& file) {
    const MeasuredFlight f = read_measured(file);
    return check_flight(f.record, f.vehicle);
  }
  static void expect_untouched(const std::filesystem::path& file) {
    const CheckedFlight c = check(file);
    for (const LogFinding& f : c.findings) EXPECT_EQ(f.action, FindingAction::note) << findings_table(c);
    EXPECT_FALSE(c.refusal) << findings_table(c);
  }
  static double rotor_offset_s(const std::string& flight) {
    const CheckedFlight c = check(measured_flights() / "idsia_nanodrone_cf21bl" / (flight + ".csv"));
    const StreamOffset* o = c.offsets.find("rotor speeds", "accelerometer");
    EXPECT_NE(o, nullptr) << findings_table(c);
    return o ? o->late_s : 0.0;
  }
};

TEST_F(MeasuredLogs, SixtyTwoCleanFlightsLoseNothing) {
  // Two flights of the bare Crazyflie have real faults of the motion capture: see the next test.
  const std::set<std::string> faulty{"eckart27.csv", "eckart30.csv"};
  std::size_t files = 0;
  for (const char* set : {"imrc_cf21bl_bare", "neurobem_test", "undeclared_a", "undeclared_b", "undeclared_c", "undeclared_d",
                          "undeclared_e", "undeclared_f"})
    for (const auto& file : flights_of(set))
      if (!faulty.contains(file.filename().string())) {
        expect_untouched(file);
        ++files;
      }
  EXPECT_EQ(files, 16u + 4u + 36u);
  for (const char* name : {"jana00", "jana02", "jana03", "jana06", "jana10", "jana11"})
    expect_untouched(measured_flights() / "imrc_cf21_brushed" / (std::string(name) + ".csv"));
}

TEST_F(MeasuredLogs, MotionCaptureThatTakesOneMarkerForAnotherIsExcludedWhereItHappens) {
  const CheckedFlight c = check(measured_flights() / "imrc_cf21bl_payload" / "eckart30.csv");
  ASSERT_FALSE(c.refusal) << findings_table(c);
  bool told = false;
  for (const LogFinding& f : c.findings)
    told = told || (f.stream == "pose" && f.action == FindingAction::exclude && f.what.find("0.33 rad") != std::string::npos);
  EXPECT_TRUE(told) << findings_table(c);
  const StreamOffset* o = c.offsets.find("pose", "gyro");
  ASSERT_NE(o, nullptr) << findings_table(c);
  EXPECT_GT(o->correlation, 0.9) << "what is left turns as the gyro says";
}

TEST_F(MeasuredLogs, BrushedFlightsWithADeadSpeedSensorAreRefusedFromFirstToLastSample) {
  for (const char* name : {"jana20", "jana24", "jana27", "jana30", "jana32"}) {
    const MeasuredFlight m = read_measured(measured_flights() / "imrc_cf21_brushed" / (std::string(name) + ".csv"));
    const CheckedFlight c = check_flight(m.record, m.vehicle);
    ASSERT_TRUE(c.refusal) << findings_table(c);
    bool rotor = false, battery = false;
    for (const LogFinding& f : c.findings) {
      battery = battery || (f.stream == "battery" && f.action == FindingAction::exclude);
      if (f.action != FindingAction::refuse) continue;
      rotor = true;
      EXPECT_EQ(f.stream, "rotor 1 speed");
      EXPECT_NEAR(f.from_s, m.record.rotor_omega_rad_s.t_s.front(), 0.1) << name;  // all of the flight: zero or half, never right
      EXPECT_NEAR(f.to_s, m.record.rotor_omega_rad_s.t_s.back(), 0.1) << name;
    }
    EXPECT_TRUE(rotor && battery) << findings_table(c);
  }
}

TEST_F(MeasuredLogs, TelemetrySpikesOfTheNanoDroneAreGoneAndNoFlightIsRefused) {
  for (const auto& file : flights_of("idsia_nanodrone_cf21bl")) {
    const CheckedFlight c = check(file);
    ASSERT_FALSE(c.refusal) << findings_table(c);
    double kept_s = 0.0, top = 0.0;
    for (const TimeRange& s : c.segments) kept_s += s.span_s();
    for (const RotorValues& w : c.flight.rotor_omega_rad_s.value)
      for (const double x : w) top = std::max(top, x);
    EXPECT_LT(top, 3000.0) << file;
    const MeasuredFlight m = read_measured(file);
    EXPECT_GT(kept_s, 0.85 * (m.record.pose.t_s.back() - m.record.pose.t_s.front())) << findings_table(c);
  }
}

TEST_F(MeasuredLogs, NanoDroneRunsHaveTheirOwnOffsetsOfMotorsAgainstAccelerometer) {
  // Two kinds of run: motors 5 ms and 25 ms ahead; square run 4 is of the second, its sisters of the first.
  EXPECT_NEAR(rotor_offset_s("square_20251017_run2"), -0.005, 0.002);
  EXPECT_NEAR(rotor_offset_s("square_20251017_run3"), -0.005, 0.002);
  EXPECT_NEAR(rotor_offset_s("square_20251017_run4"), -0.024, 0.002);
  EXPECT_NEAR(rotor_offset_s("random1_20251017_run1"), -0.025, 0.002);
}

// Vehicles of another simulator, whose rotor speeds and accelerometer have one clock: what is found is the error.
TEST_F(MeasuredLogs, ErrorsOfRotorOffsetsAreThoseThatTheirUncertaintySaysWhereTheTruthIsZero) {
  const log::LogMapping mapping =
      log::read_log_mapping(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "vehicles/measured/undeclared_a.mapping.toml");
  const MeasuredFlight any = read_measured(measured_flights() / "undeclared_a" / "rotation.csv");
  double square = 0.0, worst = 0.0;
  int reported = 0, flights = 0;
  for (int set = 1; set <= 16; ++set)
    for (const char* name : {"general", "general2", "rotation"}) {
      const auto file = measured_flights() / "development" / ((set < 10 ? "d0" : "d") + std::to_string(set)) / (std::string(name) + ".csv");
      const CheckedFlight c = check_flight(read_flight(file, &mapping), any.vehicle);
      ++flights;
      const StreamOffset* o = c.offsets.find("rotor speeds", "accelerometer");
      if (!o) continue;
      ++reported;
      square += o->late_s * o->late_s / (o->u_s * o->u_s);
      worst = std::max(worst, std::abs(o->late_s));
    }
  const double rms_z = std::sqrt(square / std::max(1, reported));
  std::printf("rotor offsets of %d flights: %d reported, rms of error over u %.2f, largest error %.1f ms\n", flights, reported, rms_z,
              1e3 * worst);
  EXPECT_GE(reported, 30);
  EXPECT_LT(rms_z, 2.0);
}

TEST_F(MeasuredLogs, WithoutPoseOrRotorSpeedsTheFlownWindowsThatTheAuthorsChoseByHandAreKept) {
  // Thrust curve, roll and pitch inertia, yaw inertia: the windows of the publication's notebook, taken by eye.
  const std::vector<std::pair<std::string, TimeRange>> windows{
      {"log10", {35.0, 65.0}}, {"log15", {55.0, 90.0}}, {"log16", {32.0, 38.0}}, {"log16", {45.2, 49.0}}};
  for (const auto& [name, window] : windows) {
    const CheckedFlight c = check(measured_flights() / "arpl_crazyflie_sysid" / (name + ".csv"));
    ASSERT_FALSE(c.refusal) << findings_table(c);
    bool kept = false;
    for (const TimeRange& s : c.segments) kept = kept || (s.from_s <= window.from_s && s.to_s >= window.to_s);
    EXPECT_TRUE(kept) << findings_table(c);
    EXPECT_EQ(c.findings.front().action, FindingAction::exclude) << "on the ground first\n" << findings_table(c);
  }
}

TEST_F(MeasuredLogs, TakeOffAndLandingAreCutAndTheFlightBetweenIsKept) {
  for (const char* set : {"nanobench_cf21", "crazypad_faults"}) {
    for (const auto& file : flights_of(set)) {
      const MeasuredFlight m = read_measured(file);
      const CheckedFlight c = check_flight(m.record, m.vehicle);
      ASSERT_FALSE(c.refusal) << findings_table(c);
      double kept_s = 0.0;
      for (const TimeRange& s : c.segments) kept_s += s.span_s();
      EXPECT_GT(kept_s, std::string(set) == "nanobench_cf21" ? 20.0 : 10.0) << findings_table(c);
      const auto low = [](double z) { return z < 0.10; };  // of 0.5 m and more flown
      std::size_t on_floor = 0;
      for (const PoseReading& p : c.flight.pose.value) on_floor += low(p.p_W_m.z());
      for (const Eigen::Vector3d& p : c.flight.position_W_m.value) on_floor += low(p.z());
      EXPECT_LE(on_floor, (c.flight.pose.size() + c.flight.position_W_m.size()) / 20) << findings_table(c);
    }
  }
}

}  // namespace
}  // namespace rotorloop::log
