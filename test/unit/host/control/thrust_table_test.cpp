// The table against the equations it stands for.
#include "host/control/thrust_table.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "host/vehicle/thrust.hpp"
#include "test/unit/host/control/paper_vehicle.hpp"

namespace rotorloop::host {
namespace {

const ThrustModel kModel = test::paper_vehicle().thrust;

TEST(ThrustTable, FullLookupIsWithinATenthOfAPercentOfTheEquations) {
  const ThrustTable table(kModel, ThrustLookup::full);
  double worst = 0.0;
  for (double omega = 500.0; omega <= 1700.0; omega += 97.0)
    for (double v_z = -5.0; v_z <= 5.0; v_z += 0.43)
      for (double v_xy = 0.0; v_xy <= 12.0; v_xy += 0.71) {
        const double exact = solve_thrust(kModel, omega, v_z, v_xy).c_t_N_s2;
        worst = std::fmax(worst, std::fabs(table.at(omega, v_z, v_xy).c_t_N_s2 / exact - 1.0));
      }
  EXPECT_LT(worst, 1e-3);
}

TEST(ThrustTable, AxialLookupIsThePapersAndMissesTheLiftOfForwardFlight) {
  const ThrustTable axial(kModel, ThrustLookup::axial);
  EXPECT_NEAR(axial.at(940, 2.5, 0.0).c_t_N_s2 / solve_thrust(kModel, 940, 2.5, 0.0).c_t_N_s2, 1.0, 1e-3);
  EXPECT_EQ(axial.at(940, 2.5, 8.5).c_t_N_s2, axial.at(940, 2.5, 0.0).c_t_N_s2);
  EXPECT_LT(axial.at(940, 0.0, 8.5).c_t_N_s2, 0.92 * solve_thrust(kModel, 940, 0.0, 8.5).c_t_N_s2);
}

TEST(ThrustTable, StillAirLookupIgnoresMotion) {
  const ThrustTable still(kModel, ThrustLookup::still_air);
  EXPECT_EQ(still.at(940, 3.1, 8.0).c_t_N_s2, static_c_t(kModel));
  EXPECT_EQ(still.at(940, 3.1, 8.0).slope_N_s2, static_c_t(kModel));
}

TEST(ThrustTable, SlopeIsTheDerivativeOfThrustBySpeedSquared) {
  const ThrustTable table(kModel, ThrustLookup::full);
  for (const double v_z : {-2.9, 0.3, 2.9}) {
    const double omega = 933.0, h = 5.0;
    const double up = solve_thrust(kModel, omega + h, v_z, 4.0).thrust_N, down = solve_thrust(kModel, omega - h, v_z, 4.0).thrust_N;
    const double slope = (up - down) / (std::pow(omega + h, 2) - std::pow(omega - h, 2));
    EXPECT_NEAR(table.at(omega, v_z, 4.0).slope_N_s2 / slope, 1.0, 0.02) << v_z;
  }
}

TEST(ThrustTable, BeyondItsEdgesItClampsAndSaysSo) {
  const ThrustTable table(kModel, ThrustLookup::full);
  EXPECT_FALSE(table.at(940, 3.0, 8.0).at_edge);
  const ThrustTable::Value climbing = table.at(300.0, 8.0, 0.0);  // no thrust left at this speed
  EXPECT_TRUE(climbing.at_edge);
  EXPECT_DOUBLE_EQ(climbing.c_t_N_s2, ThrustTable::kFloor * table.still_air_c_t_N_s2());
  EXPECT_TRUE(table.at(250.0, -20.0, 0.0).at_edge);
  EXPECT_TRUE(table.at(250.0, 0.0, 30.0).at_edge);
}

}  // namespace
}  // namespace rotorloop::host
