// A pose that shows the moment 20 ms before its stamp: read at the node of its stamp, the state would have to be carried back 20 ms in
// a straight line, and the fit would pay with a wrong delay. Associated with the node of the moment it shows, it is read where it belongs.
#include <gtest/gtest.h>

#include <cmath>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/model/rotations.hpp"
#include "bench/sysid/estimate/residuals.hpp"

namespace rotorloop::estimate {
namespace {

constexpr double kDelay_s = 0.020, kBend_m_s2 = 12.0;

// Two seconds along x with acceleration kBend, poses at 200 Hz stamped `kDelay_s` late.
log::FlightRecord late_flight() {
  log::FlightRecord record;
  record.name = record.source = "late";
  for (int k = 0; k <= 400; ++k) {
    const double t = 0.005 * k, shown = t - kDelay_s;
    record.pose.add(t, {{0.5 * kBend_m_s2 * shown * shown, 0, 0}, Eigen::Quaterniond::Identity()});
    record.rotor_omega_rad_s.add(t, {900, 900, 900, 900});
  }
  return record;
}

ModelValues values_with_delay() {
  host::VehicleModel m;
  m.mass_kg = 0.7;
  m.inertia_kg_m2 = {2e-3, 3e-3, 5e-3};
  m.thrust = {3e-6, -1.5e-4, 0.0635, 1.2};
  ModelValues v = model_values(m);
  v[kPoseDelay] = kDelay_s;
  return v;
}

// Largest position residual with every state at its true place, in metres.
double worst_residual_m(const GridFlight& grid) {
  NoiseModel unit;
  unit.position_m.setOnes();
  const Residuals residuals(grid, values_with_delay(), unit, {});
  RowsBy<6> rows;
  double worst = 0.0;
  for (const PoseFix& fix : grid.pose) {
    const double t = grid.time_s(fix.node);
    BodyState truth;
    truth.p_W_m.x() = 0.5 * kBend_m_s2 * t * t;
    truth.v_W_m_s.x() = kBend_m_s2 * t;
    residuals.pose(fix, truth, rows, false);
    worst = std::max(worst, rows.r.head<3>().norm());
  }
  return worst;
}

TEST(PoseTimeOffset, AtTheNodeOfTheirStamp20msAt12mS2LookLike2p4MmOfError) {
  EXPECT_NEAR(worst_residual_m(make_grid(late_flight(), {})), 0.5 * kBend_m_s2 * kDelay_s * kDelay_s, 1e-6);
}

TEST(PoseTimeOffset, AssociatedWithTheMomentTheyShowTheyAgreeToAMicrometre) {
  GridFlight grid = make_grid(late_flight(), {});
  associate_poses(grid, kDelay_s);
  EXPECT_LT(worst_residual_m(grid), 1e-6);
  EXPECT_EQ(grid.pose.size(), 397u);  // four show moments before the first node
}

TEST(PoseTimeOffset, ADelayBetweenTwoNodesIsCarriedOverHalfAStepAtMost) {
  GridFlight grid = make_grid(late_flight(), {});
  associate_poses(grid, 0.0178);
  for (const PoseFix& fix : grid.pose) EXPECT_LE(std::fabs(fix.late_s - 0.0178), 0.0025 + 1e-12);
}

TEST(PoseTimeOffset, TyingBackRestoresTheStamps) {
  const GridFlight before = make_grid(late_flight(), {});
  GridFlight grid = before;
  associate_poses(grid, kDelay_s);
  associate_poses(grid, 0.0);
  ASSERT_EQ(grid.pose.size(), 397u);
  EXPECT_EQ(grid.pose.front().node, before.pose[4].node);
  EXPECT_NEAR(grid.pose.front().late_s, before.pose[4].late_s, 1e-12);
}

TEST(PoseTimeOffset, FirstGuessOfTheStatesAllowsForTheDelay) {
  GridFlight grid = make_grid(late_flight(), {});
  associate_poses(grid, kDelay_s);
  const std::vector<BodyState> guess = guess_states(grid, values_with_delay());
  const double t = grid.time_s(200);
  EXPECT_NEAR(guess[200].p_W_m.x(), 0.5 * kBend_m_s2 * t * t, 1e-6);
  EXPECT_NEAR(guess[200].v_W_m_s.x(), kBend_m_s2 * t, 1e-3);
}

}  // namespace
}  // namespace rotorloop::estimate
