// The disk map: its integral is the loads of the solve, and its cells lie where they say.
#include "sim/rotor/disk.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
using test::at;
using test::hover_omega;
using test::rotor;

struct Integral {
  double thrust_N = 0.0, torque_N_m = 0.0, roll_N_m = 0.0, pitch_N_m = 0.0, area_m2 = 0.0;
};
Integral integrate(const RotorDisk& d) {
  Integral sum;
  for (const DiskCell& c : d.cells) {
    const double thrust = c.thrust_N_per_m2 * c.area_m2;
    sum.area_m2 += c.area_m2;
    sum.thrust_N += thrust;
    sum.torque_N_m += c.torque_N_m_per_m2 * c.area_m2;
    sum.roll_N_m += thrust * c.r_m * std::sin(c.psi_rad);
    sum.pitch_N_m -= thrust * c.r_m * std::cos(c.psi_rad);
  }
  return sum;
}

TEST(Disk, IntegralOfTheMapIsTheLoadsOfTheSolve) {
  for (int step = 0; step < 8000; step += 97)
    for (int spin : {1, -1}) {
      RotorCondition c = test::flight_state(step);
      c.spin = spin;
      const RotorDisk d = solve_rotor_disk(rotor(), c);
      const Integral sum = integrate(d);
      const double thrust = d.loads.force_R_N.z(), moment = thrust * rotor().radius_m();
      ASSERT_NEAR(sum.thrust_N, thrust, 1e-11 * thrust) << step;
      ASSERT_NEAR(sum.torque_N_m, d.loads.shaft_torque_N_m, 1e-11 * moment) << step;
      ASSERT_NEAR(sum.roll_N_m, d.loads.moment_R_N_m.x(), 1e-11 * moment) << step << " spin " << spin;
      ASSERT_NEAR(sum.pitch_N_m, d.loads.moment_R_N_m.y(), 1e-11 * moment) << step << " spin " << spin;
      ASSERT_NEAR(sum.area_m2, rotor().disk_area_m2(), 1e-6 * rotor().disk_area_m2());
    }
}
TEST(Disk, AdvancingSideMovesFasterAndHasTheLargerReynoldsNumberEitherWayRound) {
  for (int spin : {1, -1}) {
    const RotorDisk d = solve_rotor_disk(rotor(), at(10, 0, 0, hover_omega(), spin));
    const double tip = hover_omega() * 0.9 * rotor().radius_m();
    for (const DiskCell& c : d.cells) {
      const double advance = -10.0 * spin * std::sin(c.psi_rad);  // flying along x, the side that moves along x advances
      EXPECT_NEAR(c.tangential_m_s, hover_omega() * c.r_m + advance, 0.06 * tip);
    }
  }
}
TEST(Disk, WakeOfForwardFlightIsBlownBackAndTurnsTheAngleOfAttackDownThere) {
  const RotorDisk d = solve_rotor_disk(rotor(), at(8, 0, 0, hover_omega()));
  double ahead = 0.0, behind = 0.0;
  for (const DiskCell& c : d.cells) (std::cos(c.psi_rad) > 0.0 ? ahead : behind) += c.induced_m_s * c.area_m2;
  EXPECT_GT(behind, 1.2 * ahead);
}
TEST(Disk, HoverIsEvenRoundTheCircleAndItsOuterHalfHasAngleOfAttack5To15Degrees) {
  const RotorDisk d = solve_rotor_disk(rotor(), at(0, 0, 0, hover_omega()));
  for (int i = 0; i < d.radial; ++i)
    for (int k = 1; k < d.azimuth; ++k) {
      EXPECT_EQ(d.at(i, k).thrust_N_per_m2, d.at(i, 0).thrust_N_per_m2);
      EXPECT_EQ(d.at(i, k).through_m_s, d.at(i, k).induced_m_s);
      if (d.at(i, k).r_m > 0.5 * rotor().radius_m() && d.at(i, k).r_m < 0.95 * rotor().radius_m()) {
        EXPECT_GT(d.at(i, k).alpha_rad, 5 * std::numbers::pi / 180);
        EXPECT_LT(d.at(i, k).alpha_rad, 15 * std::numbers::pi / 180);
      }
    }
}
TEST(Disk, ConditionThatIsNotFiniteGivesNoCells) {
  const RotorDisk d = solve_rotor_disk(rotor(), at(std::numeric_limits<double>::quiet_NaN(), 0, 0, 900));
  EXPECT_TRUE(d.cells.empty());
  EXPECT_EQ(d.loads.status, InflowStatus::not_converged);
}

}  // namespace
}  // namespace rotorloop::sim
