// The load on a string against what a pendulum must do: its period, its tension, Newton's law for both bodies, and how it comes to rest.
#include "host/effects/slung_load.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

constexpr double kDt_s = 0.005, kPi = 3.14159265358979323846;

struct Parameters {
  double mass_kg = 0.05, length_m = 0.5, damping = 0.0, drag_1_m = 0.0, attach_z_m = 0.0;
};
VehicleModel vehicle() {
  VehicleModel m = paper_vehicle();
  m.com_offset_m.setZero();
  return m;
}

// The loads of a body that moves as told, with the string of the moment.
struct Body {
  VehicleModel model = vehicle();
  LoadInput<double> in;
  LoadParameters<double> parameters = load_parameters(model);
  LoadGeometry geometry = load_geometry(model);
  LoadState<double> state{in, parameters, geometry, {}, {}, {}, {}, {}, {}, {}};

  explicit Body(const LoadInput<double>& input) : in(input) { loads<double>(state, nullptr); }
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;
};

// Swings for a time under a body that flies at `v_m_s` and accelerates with `a_m_s2`, all level and along the world's axes.
template <class Look>
void swing(const Parameters& p, std::array<double, 4> start, double time_s, const Vec3<double>& a_m_s2, double v_m_s, Look&& look) {
  LoadInput<double> in = hover(vehicle());
  in.v_B_m_s = {v_m_s, 0, 0};
  const Body from(in), to(in);
  const double c[] = {p.mass_kg, p.length_m, p.damping, p.drag_1_m, p.attach_z_m};
  for (int k = 0; k < static_cast<int>(std::lround(time_s / kDt_s)); ++k) {
    SlungLoad::advance(c, {from.state, to.state, a_m_s2, {}, kDt_s}, start.data());
    look((k + 1) * kDt_s, start);
  }
}

TEST(SlungLoad, SmallSwingsHaveThePeriodOfAPendulumWithin0p1percentAndKeepTheirSizeFor20s) {
  const Parameters p;
  double last_crossing_s = 0.0, first_crossing_s = 0.0, before = 0.05, highest = 0.0;
  int crossings = 0;
  swing(p, {0.05, 0, 0, 0}, 20.0, {}, 0.0, [&](double t, const auto& q) {
    if (before < 0.0 && q[0] >= 0.0) {
      last_crossing_s = t - kDt_s * q[0] / (q[0] - before);
      if (crossings++ == 0) first_crossing_s = last_crossing_s;
    }
    before = q[0];
    if (t > 18.0) highest = std::max(highest, q[0]);
  });
  const double period_s = (last_crossing_s - first_crossing_s) / (crossings - 1);
  EXPECT_NEAR(period_s, 2.0 * kPi * std::sqrt(p.length_m / kGravity_m_s2), 1e-3 * period_s);
  EXPECT_NEAR(highest, 0.05, 1e-4);
}

TEST(SlungLoad, DampedSwingFallsByExpOfMinus2PiZetaEachPeriod) {
  double highest = 0.0;
  const double period_s = 2.0 * kPi * std::sqrt(0.5 / kGravity_m_s2);
  swing({.damping = 0.05}, {0.05, 0, 0, 0}, 4.2 * period_s, {}, 0.0, [&](double t, const auto& q) {
    if (t > 3.6 * period_s) highest = std::max(highest, q[0]);
  });
  EXPECT_NEAR(highest / 0.05, std::exp(-2.0 * kPi * 0.05 * 4.0), 0.01);
}

TEST(SlungLoad, SteadyAccelerationHangsItAlongApparentGravityAndDragLetsItTrail) {
  std::array<double, 4> end{};
  const auto keep = [&](double, const auto& q) { end = q; };
  swing({.damping = 0.3}, {0, 0, 0, 0}, 12.0, {2.0, 0, 0}, 0.0, keep);
  EXPECT_NEAR(end[0], -2.0 / std::sqrt(4.0 + kGravity_m_s2 * kGravity_m_s2), 1e-3);  // behind the vehicle that speeds up
  swing({.damping = 0.3, .drag_1_m = 0.02}, {0, 0, 0, 0}, 12.0, {}, 8.0, keep);
  EXPECT_NEAR(end[0] / std::sqrt(1.0 - end[0] * end[0]), -0.02 * 64.0 / kGravity_m_s2, 2e-3);
}

// Given the pull on the body, the accelerations of both ends follow; the one of the load must be that of the hook plus L d̈.
TEST(SlungLoad, PullKeepsBodyAndLoadAtTheLengthOfTheString) {
  const Parameters p{.mass_kg = 0.1, .length_m = 0.7};
  const std::vector<double> values{p.mass_kg, p.length_m, 0.0, 0.0, 0.0};
  const std::array<double, 4> q{0.3, -0.2, 1.5, 0.8};
  const TermList list = only("slung_load");
  LoadInput<double> in = hover(vehicle());
  const Body without(in);
  Body with(in);
  const TermSet<double> set(list, values.data(), q.data());
  loads(with.state, &set);
  const Eigen::Vector3d d(q[0], q[1], -std::sqrt(1 - q[0] * q[0] - q[1] * q[1]));
  const Eigen::Vector3d rate(q[2], q[3], -(d.x() * q[2] + d.y() * q[3]) / d.z());
  const auto force = [](const Body& b) { return Eigen::Vector3d(b.state.force_B_N.x, b.state.force_B_N.y, b.state.force_B_N.z); };
  const Eigen::Vector3d pull = force(with) - force(without), gravity(0, 0, -kGravity_m_s2);
  EXPECT_LT(pull.cross(d).norm(), 1e-12);
  EXPECT_GT(pull.dot(d), 0.0);
  const Eigen::Vector3d body = force(with) / with.model.mass_kg + gravity, load = gravity - pull / p.mass_kg;
  EXPECT_NEAR((load - body).dot(d), -p.length_m * rate.squaredNorm(), 1e-9);  // the string neither stretches nor slackens
}

TEST(SlungLoad, StringGoesSlackWhenTheBodyIsPushedDownOnItsLoadAndTightWhenItIsHeldUp) {
  const TermList list = only("slung_load");
  const std::vector<double> values{0.1, 0.5, 0.0, 0.0, 0.0}, rest(4, 0.0);
  const auto pull_N = [&](double climb_m_s) {
    LoadInput<double> in = hover(vehicle());
    in.omega_rad_s.fill(0.0);  // the body falls as its load does, but for its drag
    in.v_B_m_s = {0, 0, climb_m_s};
    const Body without(in);
    Body with(in);
    const TermSet<double> set(list, values.data(), rest.data());
    loads(with.state, &set);
    return without.state.force_B_N.z - with.state.force_B_N.z;
  };
  EXPECT_EQ(pull_N(3.0), 0.0);
  EXPECT_NEAR(pull_N(-3.0), 0.1 / 0.782 * 0.0185 * 9.0, 1e-6);
}

TEST(SlungLoad, HookBelowTheCentreOfMassTurnsTheBodyTowardsTheLoad) {
  const TermList list = only("slung_load");
  const std::vector<double> values{0.05, 0.5, 0.0, 0.0, -0.03};
  const std::vector<double> ahead{0.1, 0.0, 0.0, 0.0};
  LoadInput<double> in = hover(vehicle());
  const Body without(in);
  Body with(in);
  const TermSet<double> set(list, values.data(), ahead.data());
  loads(with.state, &set);
  const double forward_N = with.state.force_B_N.x - without.state.force_B_N.x;
  EXPECT_GT(forward_N, 0.0);
  EXPECT_NEAR(with.state.torque_B_N_m.y - without.state.torque_B_N_m.y, -0.03 * forward_N, 1e-12);  // nose up
}

TEST(SlungLoad, SwingBeyond70degreesIsHeldThere) {
  double highest = 0.0;
  swing({}, {0.9, 0, 8.0, 0}, 3.0, {}, 0.0, [&](double, const auto& q) {
    for (const double x : q) ASSERT_TRUE(std::isfinite(x));
    highest = std::max(highest, std::hypot(q[0], q[1]));
  });
  EXPECT_LE(highest, 0.94 + 1e-12);
}

TEST(TermMemory, IsCountedInTheOrderOfTheListAndRefusedBeyondItsRoom) {
  TermList list;
  EXPECT_TRUE(list.add(*find_term("rotor_local_inflow")));
  EXPECT_TRUE(list.add(*find_term("slung_load")));
  EXPECT_TRUE(list.add(*find_term("linear_drag")));
  EXPECT_EQ(list.memory(), 4u);
  EXPECT_EQ(list.first_memory(1), 0u);
  EXPECT_EQ(list.parameters(), 1u + 9u + 3u);
  EXPECT_FALSE(list.is_start(5));
  EXPECT_TRUE(list.is_start(6));
  EXPECT_FALSE(list.is_start(10));
  EXPECT_EQ(list.parameter(9).name, "start_rate_y");
  std::array<Term, 8> more;
  more.fill(*find_term("slung_load"));
  const char* names[] = {"a", "b", "c", "d", "e", "f", "g", "h"};
  std::size_t added = 0;
  for (std::size_t i = 0; i < more.size(); ++i) {
    more[i].info.id = names[i];
    added += list.add(more[i]);
  }
  EXPECT_EQ(added, kMaxMemory / 4 - 1);
}

}  // namespace
}  // namespace rotorloop::host
