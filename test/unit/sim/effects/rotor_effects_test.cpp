// Effects on the loads of one rotor: what they change, by how much, and what they leave alone.
#include <gtest/gtest.h>

#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

RotorLoads changed(std::string_view id, double value) {
  const BodyMotion m = some_motion();
  RotorLoads l = some_loads();
  make(id, value)->rotor_loads(site(0, m), l);
  return l;
}

TEST(RotorBodyInterference, MultipliesTheInPlaneForceAndNothingElse) {
  const RotorLoads l = changed("rotor_body_interference", 2.5);
  EXPECT_LT((l.force_R_N - Eigen::Vector3d(-0.5, 0.125, 1.7)).norm(), 1e-15);
  EXPECT_EQ(l.moment_R_N_m, some_loads().moment_R_N_m);
  EXPECT_EQ(l.shaft_torque_N_m, some_loads().shaft_torque_N_m);
}
TEST(BlockageStrut, TakesTheLossFromTheThrustAndNothingElse) {
  const RotorLoads l = changed("blockage_strut", 0.08);
  EXPECT_LT((l.force_R_N - Eigen::Vector3d(-0.2, 0.05, 1.7 * 0.92)).norm(), 1e-15);
  EXPECT_EQ(l.moment_R_N_m, some_loads().moment_R_N_m);
  EXPECT_EQ(l.shaft_torque_N_m, some_loads().shaft_torque_N_m);
}

}  // namespace
}  // namespace rotorloop::sim
