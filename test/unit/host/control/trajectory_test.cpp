// Trajectories: evaluation against hand-made polynomials, the file's refusals, the generator's promises, and the shipped flights.
#include "host/control/trajectory.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <string_view>

#include "host/base/error.hpp"
#include "host/control/trajectory_file.hpp"
#include "host/control/trajectory_generator.hpp"

namespace rotorloop::host {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::filesystem::path kShipped = std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "scenarios/trajectories";

constexpr const char* kContractExample = R"(
format = 1
name = "example"
[[segment]]
duration_s = 2.0
x_m = [0.0, 0.0, 0.0, 1.25, -0.9375, 0.1875]
y_m = [0.0]
z_m = [2.0]
yaw_rad = [0.0]
)";

std::string refusal(const std::string& text) {
  try {
    parse_trajectory(text, "flight.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

const std::string kSecond = "[[segment]]\nduration_s = 1.0\nx_m = [2.0]\ny_m = [0.0]\nz_m = [2.0]\nyaw_rad = [0.0]\n";

TEST(Trajectory, ContractExampleMovesOneMetreInTwoSeconds) {
  const Trajectory t = parse_trajectory(kContractExample, "flight.toml").trajectory;
  EXPECT_NEAR(t.at(2.0).p_W_m.x(), 1.0, 1e-12);
  EXPECT_DOUBLE_EQ(t.duration_s(), 2.0);
  // x = 1.25 t³ - 0.9375 t⁴ + 0.1875 t⁵ by hand at t = 1
  const Setpoint s = t.at(1.0);
  EXPECT_NEAR(s.p_W_m.x(), 0.5, 1e-12);
  EXPECT_NEAR(s.v_W_m_s.x(), 3 * 1.25 - 4 * 0.9375 + 5 * 0.1875, 1e-12);
  EXPECT_NEAR(s.a_W_m_s2.x(), 6 * 1.25 - 12 * 0.9375 + 20 * 0.1875, 1e-12);
  EXPECT_NEAR(s.j_W_m_s3.x(), 6 * 1.25 - 24 * 0.9375 + 60 * 0.1875, 1e-12);
  EXPECT_NEAR(s.s_W_m_s4.x(), -24 * 0.9375 + 120 * 0.1875, 1e-12);
}

TEST(Trajectory, DerivativesAgreeWithDifferencesInAGeneralFlight) {
  const Trajectory t = general().trajectory;
  constexpr double h = 1e-4;
  for (double time = 2.1; time < 15.0; time += 0.237) {
    const Setpoint a = t.at(time - h), b = t.at(time), c = t.at(time + h);
    ASSERT_LT(((c.p_W_m - a.p_W_m) / (2 * h) - b.v_W_m_s).norm(), 1e-5);
    ASSERT_LT(((c.v_W_m_s - a.v_W_m_s) / (2 * h) - b.a_W_m_s2).norm(), 1e-5);
    ASSERT_LT(((c.a_W_m_s2 - a.a_W_m_s2) / (2 * h) - b.j_W_m_s3).norm(), 1e-4);
    ASSERT_LT(((c.j_W_m_s3 - a.j_W_m_s3) / (2 * h) - b.s_W_m_s4).norm(), 1e-3);
    ASSERT_NEAR((c.yaw_rad - a.yaw_rad) / (2 * h), b.yaw_rate_rad_s, 1e-5);
    ASSERT_NEAR((c.yaw_rate_rad_s - a.yaw_rate_rad_s) / (2 * h), b.yaw_accel_rad_s2, 1e-5);
  }
}

TEST(Trajectory, TimeIsClampedToRestAtBothEnds) {
  const Trajectory t = parse_trajectory(kContractExample, "flight.toml").trajectory;
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double time : {-1.0, -infinity, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(t.at(time).p_W_m, Eigen::Vector3d(0, 0, 2)) << time;
    EXPECT_EQ(t.at(time).v_W_m_s.norm(), 0.0);
  }
  for (const double time : {2.5, 1e9, infinity}) {
    EXPECT_NEAR(t.at(time).p_W_m.x(), 1.0, 1e-12) << time;
    EXPECT_EQ(t.at(time).v_W_m_s.norm(), 0.0);
    EXPECT_EQ(t.at(time).a_W_m_s2.norm(), 0.0);
  }
  EXPECT_EQ(Trajectory{}.at(1.0).p_W_m.norm(), 0.0);
}

TEST(Trajectory, MotionLastsFromTheFirstToTheLastMovingSegment) {
  const Trajectory t = horizontal_8p5().trajectory;
  EXPECT_DOUBLE_EQ(t.first_motion_s(), 2.0);
  EXPECT_NEAR(t.last_motion_s(), t.duration_s() - 1.0, 1e-12);
  const Trajectory still = join({hover({0, 0, 1}, 0.0, 3.0)});
  EXPECT_EQ(still.first_motion_s(), 0.0);
  EXPECT_EQ(still.last_motion_s(), 0.0);
}

TEST(TrajectoryFile, TextReadsBackToTheSameTrajectory) {
  const TrajectoryFile f = general();
  const TrajectoryFile back = parse_trajectory(trajectory_text(f), "flight.toml");
  EXPECT_EQ(back.name, f.name);
  EXPECT_EQ(trajectory_text(back), trajectory_text(f));
  EXPECT_EQ(back.trajectory.at(7.3).p_W_m, f.trajectory.at(7.3).p_W_m);
}

TEST(TrajectoryFileRefuses, JumpInPosition) {
  EXPECT_THAT(refusal(kContractExample + kSecond),
              AllOf(HasSubstr("flight.toml:"), HasSubstr("position of x_m jumps from 1 m to 2 m between segments 1 and 2"),
                    HasSubstr("coefficients taken from the flight's start")));
}

TEST(TrajectoryFileRefuses, JumpInVelocity) {
  EXPECT_THAT(
      refusal(kContractExample + replaced(kSecond, "x_m = [2.0]", "x_m = [1.0, 0.5]")),
      AllOf(HasSubstr("velocity of x_m jumps from"), HasSubstr("to 0.5 m/s between segments 1 and 2"), HasSubstr("normalised time")));
}

TEST(TrajectoryFileRefuses, JumpInYawAcceleration) {
  const std::string second = replaced(replaced(kSecond, "x_m = [2.0]", "x_m = [1.0]"), "yaw_rad = [0.0]", "yaw_rad = [0.0, 0.0, 0.1]");
  EXPECT_THAT(refusal(kContractExample + second), HasSubstr("acceleration of yaw_rad jumps from 0 rad/s² to 0.2 rad/s²"));
}

TEST(TrajectoryFileRefuses, OrderEight) {
  EXPECT_THAT(refusal(replaced(kContractExample, "y_m = [0.0]", "y_m = [0, 0, 0, 0, 0, 0, 0, 0, 1]")),
              AllOf(HasSubstr("y_m has order 8, the highest is 7"), HasSubstr("split the segment")));
}

TEST(TrajectoryFileRefuses, EndInMotion) {
  EXPECT_THAT(
      refusal(replaced(kContractExample, "duration_s = 2.0", "duration_s = 1.0")),
      AllOf(HasSubstr("the flight ends with velocity of x_m = 0.9375 m/s, expected rest"), HasSubstr("add a segment that comes to rest")));
}

TEST(TrajectoryFileRefuses, StartInMotion) {
  EXPECT_THAT(refusal(replaced(kContractExample, "z_m = [2.0]", "z_m = [2.0, 1.0]")),
              HasSubstr("the flight starts with velocity of z_m = 1 m/s"));
}

TEST(TrajectoryFileRefuses, NoSegment) {
  EXPECT_THAT(refusal("format = 1\nname = \"x\"\n"), HasSubstr("[[segment]] occurs 0 times, expected 1 to 128"));
}

TEST(TrajectoryFileRefuses, DurationOfZero) {
  EXPECT_THAT(refusal(replaced(kContractExample, "duration_s = 2.0", "duration_s = 0.0")),
              HasSubstr("duration_s = 0 s is outside 0.001 to 3600 s"));
}

TEST(TrajectoryFileRefuses, MissingAxisAndUnknownKey) {
  EXPECT_THAT(refusal(replaced(kContractExample, "y_m = [0.0]\n", "")), HasSubstr("key \"segment[1].y_m\" is missing"));
  EXPECT_THAT(refusal(std::string(kContractExample) + "yaw_deg = [0.0]\n"), HasSubstr("unknown key"));
}

TEST(Generator, RestToRestPeaksAt2p1875And7p5132) {
  const Peaks p = peaks(join({rest_to_rest({}, {.p_W_m = {3.0, 0, 0}, .time_s = 1.7})}), 1e-4);
  EXPECT_NEAR(p.speed_xy_m_s, kPeakVelocity * 3.0 / 1.7, 1e-5);
  EXPECT_NEAR(p.accel_m_s2, kPeakAcceleration * 3.0 / (1.7 * 1.7), 1e-5);
}

TEST(Generator, SplinePassesItsWaypointsSmoothToTheSixthDerivative) {
  const std::vector<Waypoint> w{{},
                                {.p_W_m = {1, 2, 0.5}, .yaw_rad = 1.0, .time_s = 1.0},
                                {.p_W_m = {3, -1, 0}, .yaw_rad = -1.0, .time_s = 2.5},
                                {.p_W_m = {0, 0, 1}, .time_s = 3.2}};
  const std::vector<Segment> s = through(w);
  ASSERT_EQ(s.size(), 3u);
  for (std::size_t i = 0; i < s.size(); ++i) {
    EXPECT_NEAR(s[i].y_m.at(0.0, 0), w[i].p_W_m.y(), 1e-9);
    EXPECT_NEAR(s[i].y_m.at(s[i].duration_s, 0), w[i + 1].p_W_m.y(), 1e-9);
  }
  for (std::size_t i = 0; i + 1 < s.size(); ++i)
    for (std::size_t n = 0; n <= 6; ++n)
      EXPECT_NEAR(s[i].y_m.at(s[i].duration_s, n), s[i + 1].y_m.at(0.0, n), 1e-6 * std::pow(10.0, static_cast<double>(n))) << n;
}

TEST(Generator, SplineHasLessSnapThanAnyNearbyOne) {
  // Through the same points with a perturbed middle velocity, snap grows: what "minimum" means.
  const auto cost = [](const std::vector<Segment>& segments) {
    double sum = 0.0;
    for (const Segment& s : segments)
      for (double t = 0.5e-3; t < s.duration_s; t += 1e-3) sum += 1e-3 * s.x_m.at(t, 4) * s.x_m.at(t, 4);
    return sum;
  };
  const std::vector<Waypoint> w{{}, {.p_W_m = {1, 0, 0}, .time_s = 1.0}, {.p_W_m = {0.5, 0, 0}, .time_s = 2.0}};
  const double best = cost(through(w));
  for (const double bump : {-0.05, 0.05}) {
    // The middle velocity changed by `bump`, all else at the waypoints kept: septic Hermite basis, before and after.
    std::vector<Segment> s = through(w);
    const Polynomial before{{0, 0, 0, 0, -15, 39, -34, 10}}, after{{0, 1, 0, 0, -20, 45, -36, 10}};
    for (std::size_t k = 0; k < kCoefficients; ++k) {
      s[0].x_m.c[k] += bump * before.c[k];
      s[1].x_m.c[k] += bump * after.c[k];
    }
    for (std::size_t n = 0; n <= 3; ++n) ASSERT_NEAR(s[0].x_m.at(1.0, n), s[1].x_m.at(0.0, n), 1e-6);
    EXPECT_GT(cost(s), best);
  }
}

TEST(Generator, RefusesWaypointsThatGoBackInTime) {
  EXPECT_THROW(through({{.time_s = 1.0}, {.time_s = 0.5}}), Error);
  EXPECT_THROW(through({{}}), Error);
}

TEST(Generator, SlowedFlightTakesTheSamePathAtLowerSpeedAndAccelerationBySquare) {
  const TrajectoryFile fast = general(), slow = slowed(fast, 2.5);
  EXPECT_NEAR(slow.trajectory.duration_s(), 2.5 * fast.trajectory.duration_s(), 1e-9);
  for (double t = 0.0; t < fast.trajectory.duration_s(); t += 0.37) {
    const Setpoint f = fast.trajectory.at(t), s = slow.trajectory.at(2.5 * t);
    ASSERT_LT((s.p_W_m - f.p_W_m).norm(), 1e-9) << t;
    ASSERT_LT((2.5 * s.v_W_m_s - f.v_W_m_s).norm(), 1e-9) << t;
    ASSERT_LT((2.5 * 2.5 * s.a_W_m_s2 - f.a_W_m_s2).norm(), 1e-8) << t;
    ASSERT_NEAR(s.yaw_rad, f.yaw_rad, 1e-9) << t;
  }
  EXPECT_THROW(slowed(fast, 0.9), Error);
}

TEST(Generator, SlowingIsTheLeastFactorThatKeepsSpeedThrustAndTilt) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const Trajectory t = horizontal_8p5().trajectory;
  EXPECT_EQ(slowing(t, {9.0, kNone, kNone}), 1.0);
  EXPECT_NEAR(slowing(t, {4.0, kNone, kNone}), 8.5 / 4.0, 0.01);
  const double by_thrust = slowing(t, {kNone, 1.2, kNone});
  EXPECT_NEAR(peaks(slowed({"", t}, by_thrust).trajectory).thrust_weight_max, 1.2, 0.002);
  const double by_tilt = slowing(t, {kNone, kNone, 0.3});
  EXPECT_NEAR(peaks(slowed({"", t}, by_tilt).trajectory).tilt_rad, 0.3, 0.002);
  EXPECT_THROW(slowing(t, {kNone, 1.0, kNone}), Error);
}

struct Shipped {
  const char* file;
  TrajectoryFile (*make)();
};
constexpr std::array kFlights{Shipped{"horizontal_8p5.toml", horizontal_8p5},
                              Shipped{"vertical_3p1.toml", vertical_3p1},
                              Shipped{"vertical_3p1_brisk.toml", vertical_3p1_brisk},
                              Shipped{"general.toml", general},
                              Shipped{"identify_vertical.toml", identify_vertical},
                              Shipped{"identify_horizontal.toml", identify_horizontal},
                              Shipped{"identify_rotation.toml", identify_rotation},
                              Shipped{"fast_descent.toml", fast_descent},
                              Shipped{"low_hover.toml", low_hover},
                              Shipped{"ceiling_hover.toml", ceiling_hover},
                              Shipped{"diagnose_vertical.toml", diagnose_vertical},
                              Shipped{"diagnose_horizontal.toml", diagnose_horizontal},
                              Shipped{"diagnose_rotation.toml", diagnose_rotation}};

TEST(ShippedFlights, FilesAreWhatTheGeneratorMakes) {
  for (const Shipped& s : kFlights) {
    const Trajectory file = read_trajectory(kShipped / s.file).trajectory, made = s.make().trajectory;
    ASSERT_EQ(file.count, made.count) << s.file;
    for (double t = 0.0; t < made.duration_s(); t += 0.05)
      ASSERT_LT((file.at(t).p_W_m - made.at(t).p_W_m).norm(), 1e-9) << s.file << ' ' << t;
  }
}

TEST(ShippedFlights, HorizontalReaches8p5MetresPerSecondAnd10p8SquaredForOver20s) {
  const Trajectory t = read_trajectory(kShipped / "horizontal_8p5.toml").trajectory;
  const Peaks p = peaks(t);
  EXPECT_NEAR(p.speed_xy_m_s, 8.5, 0.01);
  EXPECT_NEAR(p.accel_m_s2, 10.8, 0.01);
  EXPECT_EQ(p.speed_z_m_s, 0.0);
  EXPECT_GE(t.duration_s(), 20.0);
  EXPECT_DOUBLE_EQ(t.first_motion_s(), 2.0);
}

TEST(ShippedFlights, VerticalReaches3p1MetresPerSecondBothWays) {
  const Trajectory t = read_trajectory(kShipped / "vertical_3p1.toml").trajectory;
  const Peaks p = peaks(t);
  EXPECT_NEAR(p.speed_z_m_s, 3.1, 0.005);
  EXPECT_NEAR(p.accel_m_s2, 2.0, 0.01);
  EXPECT_EQ(p.speed_xy_m_s, 0.0);
  double lowest = 0.0;
  for (double time = 0.0; time < t.duration_s(); time += 0.01) lowest = std::min(lowest, t.at(time).v_W_m_s.z());
  EXPECT_NEAR(lowest, -3.1, 0.005);
}

TEST(ShippedFlights, GeneralTurnsAndClimbsAsInThePapersFig11) {
  const Peaks p = peaks(read_trajectory(kShipped / "general.toml").trajectory);
  EXPECT_NEAR(p.speed_xy_m_s, 5.7, 0.02);
  EXPECT_NEAR(p.speed_z_m_s, 2.0, 0.02);
  EXPECT_NEAR(p.yaw_rate_rad_s, 5.5, 0.05);
  EXPECT_NEAR(p.roll_rate_rad_s, 2.0, 0.3);
  EXPECT_NEAR(p.pitch_rate_rad_s, 2.0, 0.3);
}

TEST(ShippedFlights, IdentificationVerticalReaches3p5MetresPerSecondOnTheSpotIn25To35s) {
  const Trajectory t = read_trajectory(kShipped / "identify_vertical.toml").trajectory;
  const Peaks p = peaks(t);
  EXPECT_NEAR(p.speed_z_m_s, 3.5, 0.005);
  EXPECT_NEAR(p.accel_m_s2, 2.5, 0.01);
  EXPECT_EQ(p.speed_xy_m_s, 0.0);
  EXPECT_THAT(t.duration_s(), AllOf(::testing::Gt(25.0), ::testing::Lt(35.0)));
}

TEST(ShippedFlights, IdentificationHorizontalReaches10p5MetresPerSecondAlongBothAxesWithin20Metres) {
  const Trajectory t = read_trajectory(kShipped / "identify_horizontal.toml").trajectory;
  EXPECT_NEAR(peaks(t).accel_m_s2, 12.0, 0.01);
  double vx = 0.0, vy = 0.0, far = 0.0;
  for (double time = 0.0; time < t.duration_s(); time += 0.002) {
    const Setpoint s = t.at(time);
    vx = std::max(vx, std::fabs(s.v_W_m_s.x()));
    vy = std::max(vy, std::fabs(s.v_W_m_s.y()));
    far = std::max(far, s.p_W_m.head<2>().norm());
  }
  EXPECT_NEAR(vx, 10.5, 0.01);
  EXPECT_NEAR(vy, 10.5, 0.01);
  EXPECT_LT(far, 20.0);
}

TEST(ShippedFlights, IdentificationRotationTurnsAboutAllThreeAxesAtOnceNearly6p5RadiansPerSecond) {
  const Trajectory t = read_trajectory(kShipped / "identify_rotation.toml").trajectory;
  const Peaks p = peaks(t);
  EXPECT_NEAR(std::max(p.roll_rate_rad_s, p.pitch_rate_rad_s), 6.2, 0.05);
  EXPECT_GT(std::min(p.roll_rate_rad_s, p.pitch_rate_rad_s), 4.5);
  EXPECT_NEAR(p.yaw_rate_rad_s, 4.9, 0.05);
  EXPECT_GT(p.thrust_weight_min, 0.6);  // rotors stay well above their idle speed
  EXPECT_LT(p.tilt_rad, 0.75);
  for (double time = 0.0; time < t.duration_s(); time += 0.01) ASSERT_LT((t.at(time).p_W_m - Eigen::Vector3d(0, 0, 2)).norm(), 0.5) << time;
}

TEST(ShippedFlights, FastDescentPassesThroughTheVortexRingAt5MetresPerSecond) {
  const Trajectory t = read_trajectory(kShipped / "fast_descent.toml").trajectory;
  const Peaks p = peaks(t);
  EXPECT_NEAR(p.speed_z_m_s, 5.0, 0.005);
  EXPECT_NEAR(p.accel_m_s2, 4.0, 0.01);
  EXPECT_GT(p.thrust_weight_min, 0.5);
}

TEST(ShippedFlights, HoversVisitGroundTo15CentimetresAndCeilingTo10AndStandStillThere) {
  const auto extreme_z_m = [](const char* file, bool lowest) {
    const Trajectory t = read_trajectory(kShipped / file).trajectory;
    double z = t.at(0.0).p_W_m.z(), still_s = 0.0;
    for (double time = 0.0; time < t.duration_s(); time += 0.01) {
      const Setpoint s = t.at(time);
      z = lowest ? std::min(z, s.p_W_m.z()) : std::max(z, s.p_W_m.z());
    }
    for (double time = 0.0; time < t.duration_s(); time += 0.01)
      if (std::fabs(t.at(time).p_W_m.z() - z) < 1e-6) still_s += 0.01;
    EXPECT_GT(still_s, 0.9) << file;
    return z;
  };
  EXPECT_NEAR(extreme_z_m("low_hover.toml", true), 0.15, 1e-9);
  EXPECT_NEAR(extreme_z_m("ceiling_hover.toml", false), 2.9, 1e-9);
}

TEST(ShippedFlights, DiagnosisFliesThreeTimes20SecondsAndOnlyTheFirstOneBetweenGroundAndCeiling) {
  for (const char* file : {"diagnose_vertical.toml", "diagnose_horizontal.toml", "diagnose_rotation.toml"}) {
    const Trajectory t = read_trajectory(kShipped / file).trajectory;
    const bool indoors = std::string_view(file) == "diagnose_vertical.toml";
    EXPECT_NEAR(t.duration_s(), 20.0, 0.6) << file;
    EXPECT_GT(peaks(t).thrust_weight_min, 0.15) << file;
    for (double time = 0.0; time < t.duration_s(); time += 0.01) {
      const double z_m = t.at(time).p_W_m.z();
      ASSERT_GE(z_m, indoors ? 0.139 : 3.8) << file << ' ' << time;
      ASSERT_LE(z_m, indoors ? 2.901 : 14.3) << file << ' ' << time;
    }
  }
}

TEST(ShippedFlights, DiagnosisMeets9MetresPerSecondOverGroundAnd5p8DownwardsAnd5RadiansPerSecond) {
  EXPECT_GT(peaks(read_trajectory(kShipped / "diagnose_horizontal.toml").trajectory).speed_xy_m_s, 9.0);
  const Trajectory t = read_trajectory(kShipped / "diagnose_rotation.toml").trajectory;
  const Peaks p = peaks(t);
  EXPECT_NEAR(std::max(p.roll_rate_rad_s, p.pitch_rate_rad_s), 5.0, 0.1);
  EXPECT_NEAR(p.yaw_rate_rad_s, 4.5, 0.05);
  double down_m_s = 0.0;
  for (double time = 0.0; time < t.duration_s(); time += 0.01) down_m_s = std::max(down_m_s, -t.at(time).v_W_m_s.z());
  EXPECT_NEAR(down_m_s, 5.83, 0.05);
}

}  // namespace
}  // namespace rotorloop::host
