// Poses that leave the motion for some tenths of a second and come back, beside a gyro that does not.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "test/unit/bench/sysid/log/check/checked_flights.hpp"

namespace rotorloop::log {
namespace {

using estimate::testing::analytic_flight;
using estimate::testing::AnalyticFlight;
using testing::change;
using testing::find;
using testing::kAlways_s;

enum class Shape { step, swell, noise };

struct Burst {
  double from_s, to_s;
};

// Every 2.5 s one of 0.1 to 0.3 s, of 0.1 to 0.5 rad and 3 to 10 cm.
std::vector<Burst> put_bursts(FlightRecord& r, Shape shape, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double least, double most) { return std::uniform_real_distribution<>(least, most)(random); };
  const auto vector = [&] {
    std::normal_distribution<> normal;
    return Eigen::Vector3d(normal(random), normal(random), normal(random));
  };
  std::vector<Burst> out;
  for (double at = r.pose.t_s.front() + 1.0; at < r.pose.t_s.back() - 1.0; at += 2.5) {
    const Burst b{at, at + between(0.1, 0.3)};
    const Eigen::Vector3d turn = between(0.1, 0.5) * vector().normalized(), shift = between(0.03, 0.1) * vector().normalized();
    for (std::size_t i = 0; i < r.pose.size(); ++i) {
      if (r.pose.t_s[i] < b.from_s || r.pose.t_s[i] > b.to_s) continue;
      const double share = shape == Shape::swell ? std::sin(std::numbers::pi * (r.pose.t_s[i] - b.from_s) / (b.to_s - b.from_s)) : 1.0;
      const Eigen::Vector3d a = shape == Shape::noise ? Eigen::Vector3d(0.06 * vector()) : Eigen::Vector3d(share * turn);
      PoseReading& p = r.pose.value[i];
      p.q_WS = p.q_WS * Eigen::Quaterniond(Eigen::AngleAxisd(a.norm(), a.normalized()));
      p.p_W_m += shape == Shape::noise ? Eigen::Vector3d(0.03 * vector()) : Eigen::Vector3d(share * shift);
    }
    out.push_back(b);
  }
  return out;
}

struct Case {
  const char* name;
  Shape shape;
  double gyro_turn_rad;  // of the gyro against the body, which nobody told
  double late_s;         // of the poses' stamps
};

// All named in one finding, nothing left between their ends and nothing lost beside them.
void expect_cut(const FlightRecord& r, const CheckedFlight& c, const std::vector<Burst>& bursts, double late_s) {
  const LogFinding* found = find(c, "pose", FindingAction::exclude, "and comes back");
  ASSERT_NE(found, nullptr) << findings_table(c);
  EXPECT_EQ(std::atoi(found->what.c_str()), static_cast<int>(bursts.size())) << found->what;
  std::size_t left = 0, lost = 0;
  for (const double t : r.pose.t_s) {
    const double on_clock = t - late_s;
    const bool there = std::binary_search(c.flight.pose.t_s.begin(), c.flight.pose.t_s.end(), t);
    for (const Burst& b : bursts) {
      left += there && on_clock > b.from_s + 0.02 && on_clock < b.to_s - 0.02;
      lost +=
          !there && ((on_clock < b.from_s - 0.025 && on_clock > b.from_s - 0.5) || (on_clock > b.to_s + 0.025 && on_clock < b.to_s + 0.5));
    }
  }
  EXPECT_EQ(left, 0u) << findings_table(c);
  EXPECT_EQ(lost, 0u) << findings_table(c);
}

class Bursts : public ::testing::TestWithParam<Case> {};

TEST_P(Bursts, OfAttitudeAreCutAtBothEndsWithin25msAndTheFlightStaysInOnePart) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    AnalyticFlight f = analytic_flight();
    const std::vector<Burst> bursts = put_bursts(f.record, GetParam().shape, seed);
    ASSERT_GE(bursts.size(), 5u);
    const Eigen::AngleAxisd turn(GetParam().gyro_turn_rad, Eigen::Vector3d(1.0, -2.0, 3.0).normalized());
    for (Eigen::Vector3d& w : f.record.gyro_B_rad_s.value) w = turn * w;
    for (double& t : f.record.pose.t_s) t += GetParam().late_s;
    const CheckedFlight c = check_flight(f.record, f.vehicle);
    expect_cut(f.record, c, bursts, GetParam().late_s);
    EXPECT_TRUE(GetParam().gyro_turn_rad != 0.0 || c.segments.size() == 1) << findings_table(c);
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, Bursts,
                         ::testing::Values(Case{"step", Shape::step, 0.0, 0.0}, Case{"swell", Shape::swell, 0.0, 0.0},
                                           Case{"noise", Shape::noise, 0.0, 0.0}, Case{"swell_turned", Shape::swell, 0.15, 0.0},
                                           Case{"swell_late", Shape::swell, 0.0, 0.012}),
                         [](const auto& i) { return i.param.name; });

// Of radio telemetry packets go missing: the integral of the gyro begins anew behind the gap.
TEST(Bursts, OnBothSidesOfGapsInTheGyroOf30And300msAreCut) {
  for (const double gap_s : {0.03, 0.3}) {
    AnalyticFlight f = analytic_flight();
    const std::vector<Burst> bursts = put_bursts(f.record, Shape::swell, 1);
    const double middle_s = 0.5 * (f.record.pose.t_s.front() + f.record.pose.t_s.back());
    const auto nearest = std::min_element(bursts.begin(), bursts.end(), [&](const Burst& a, const Burst& b) {
      return std::abs(a.from_s - middle_s) < std::abs(b.from_s - middle_s);
    });
    const double from_s = nearest->to_s + 0.7;
    Stream<Eigen::Vector3d> gyro;
    for (std::size_t i = 0; i < f.record.gyro_B_rad_s.size(); ++i)
      if (f.record.gyro_B_rad_s.t_s[i] < from_s || f.record.gyro_B_rad_s.t_s[i] > from_s + gap_s)
        gyro.add(f.record.gyro_B_rad_s.t_s[i], f.record.gyro_B_rad_s.value[i]);
    ASSERT_LT(gyro.size(), f.record.gyro_B_rad_s.size());
    f.record.gyro_B_rad_s = gyro;
    expect_cut(f.record, check_flight(f.record, f.vehicle), bursts, 0.0);
  }
}

TEST(Bursts, AreNotFoundInASoundFlightNorWhereTheAxesStayTurned) {
  const AnalyticFlight sound = analytic_flight();
  AnalyticFlight turned = analytic_flight();
  change(turned.record.pose, 108.0, kAlways_s,
         [](PoseReading& p) { p.q_WS = p.q_WS * Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())); });
  for (const AnalyticFlight* f : std::initializer_list<const AnalyticFlight*>{&sound, &turned}) {
    ASSERT_GT(f->record.pose.size(), 1000u);
    const CheckedFlight c = check_flight(f->record, f->vehicle);
    EXPECT_EQ(find(c, "pose", FindingAction::exclude, "and comes back"), nullptr) << findings_table(c);
  }
}

TEST(Bursts, OfMoreThanAFifthOfThePosesAreAnotherFault) {
  AnalyticFlight f = analytic_flight();
  for (double at = f.record.pose.t_s.front(); at < f.record.pose.t_s.back(); at += 0.8)
    change(f.record.pose, at, at + 0.3,
           [](PoseReading& p) { p.q_WS = p.q_WS * Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX())); });
  const CheckedFlight c = check_flight(f.record, f.vehicle);
  EXPECT_EQ(find(c, "pose", FindingAction::exclude, "and comes back"), nullptr) << findings_table(c);
}

}  // namespace
}  // namespace rotorloop::log
