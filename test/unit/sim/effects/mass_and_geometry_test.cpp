// What an effect changes about the body before the flight: mass, inertia, centre of mass, hubs and tilts.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

PlantSetup with(std::string_view id, double value, const std::vector<std::pair<std::string_view, double>>& options = {}) {
  PlantSetup s = reference_setup();
  make(id, value, options)->prepare(s);
  return s;
}
// What four equal thrusts along the shafts, together the weight, put on the body.
AirframeWrench hover(const PlantSetup& s, double weight_N) {
  Airframe a(s.body, at_height(10.0));
  FourLoads loads{};
  for (RotorLoads& l : loads) l.force_R_N.z() = weight_N / 4.0;
  a.step(loads, Four{}, Four{});
  return a.wrench();
}
Eigen::Vector3d hover_moment(const PlantSetup& s, double weight_N) { return hover(s, weight_N).rotor_moment_B_N_m; }
Eigen::Vector3d hover_force(const PlantSetup& s, double weight_N) { return hover(s, weight_N).rotor_force_B_N; }
const double kWeight_N = kMass_kg * kGravity_m_s2;

TEST(PayloadMass, AddsItsMassAndMovesTheCentreOfMassByTheLeverRule) {
  const PlantSetup s = with("payload_mass", 0.1, {{"x_m", 0.05}, {"z_m", -0.04}});
  EXPECT_NEAR(s.body.mass_kg, kMass_kg + 0.1, 1e-15);
  EXPECT_LT((s.body.com_offset_m - 0.1 / (kMass_kg + 0.1) * Eigen::Vector3d(0.05, 0.0, -0.04)).norm(), 1e-15);
}
TEST(PayloadMass, AddsTheInertiaOfTwoMassesAboutTheirCommonCentre) {
  const double reduced_kg = 0.1 * kMass_kg / (0.1 + kMass_kg), z_m = 0.04;
  const PlantSetup s = with("payload_mass", 0.1, {{"z_m", -z_m}});
  const Eigen::Matrix3d gained = s.body.inertia_kg_m2 - reference_body().inertia_kg_m2;
  EXPECT_NEAR(gained(0, 0), reduced_kg * z_m * z_m, 1e-15);
  EXPECT_NEAR(gained(1, 1), reduced_kg * z_m * z_m, 1e-15);
  EXPECT_NEAR(gained(2, 2), 0.0, 1e-15);
}
TEST(PayloadMass, LeavesThePoseSensorWhereItIsOnTheBody) {
  const PlantSetup before = reference_setup(), after = with("payload_mass", 0.2, {{"x_m", 0.1}});
  EXPECT_LT((after.pose.offset_B_m + after.body.com_offset_m - before.pose.offset_B_m - before.body.com_offset_m).norm(), 1e-15);
}

TEST(ComOffset, IsAbout9MillinewtonmetresNoseDownWhenTheMassIs1Point4MillimetresForward) {
  const Eigen::Vector3d forward = hover_moment(with("com_offset", 1.4e-3), kWeight_N);
  EXPECT_NEAR(forward.y(), kWeight_N * 1.4e-3, 1e-12) << "thrust behind the centre of mass; a moment along +y is nose down";
  EXPECT_NEAR(std::fabs(forward.y()), 9.4e-3, 0.1e-3);
  EXPECT_NEAR(hover_moment(with("com_offset", 0.0, {{"dy_m", 1.4e-3}}), kWeight_N).x(), -kWeight_N * 1.4e-3, 1e-12);
}
TEST(ComOffset, LeavesMassAndInertia) {
  const PlantSetup s = with("com_offset", 0.01);
  EXPECT_EQ(s.body.mass_kg, kMass_kg);
  EXPECT_EQ(s.body.inertia_kg_m2, reference_body().inertia_kg_m2);
}

TEST(ProductsOfInertia, StandInTheirPlacesAndKeepTheMatrixSymmetric) {
  const PlantSetup s = with("products_of_inertia", 2e-4, {{"I_xy_kg_m2", -1e-4}, {"I_yz_kg_m2", 3e-4}});
  const Eigen::Matrix3d& I = s.body.inertia_kg_m2;
  EXPECT_EQ(I, I.transpose());
  EXPECT_EQ(I(0, 2), 2e-4);
  EXPECT_EQ(I(0, 1), -1e-4);
  EXPECT_EQ(I(1, 2), 3e-4);
  EXPECT_NEAR(I.trace(), reference_body().inertia_kg_m2.trace(), 1e-18);
}
TEST(ProductsOfInertia, AYawTorqueThenRollsTheBodyToo) {
  const PlantSetup s = with("products_of_inertia", 2e-4);
  Airframe a(s.body, at_height(10.0));
  FourLoads loads{};
  loads[0].moment_R_N_m.z() = 0.05;
  a.step(loads, Four{}, Four{});
  EXPECT_LT(a.state().w_B_rad_s.x(), 0.0) << "I_xz > 0: acceleration about x against that about z";
  EXPECT_GT(a.state().w_B_rad_s.z(), 0.0);
}

TEST(RotorTilt, OneDegreeIsAbout0Point03NewtonSidewaysInHover) {
  const double side_N = kWeight_N / 4.0 * 0.01745;
  EXPECT_NEAR(side_N, 0.03, 0.002);
  const Eigen::Vector3d forward = hover_force(with("rotor_tilt", 1.0), kWeight_N);
  EXPECT_NEAR(forward.x(), side_N, 1e-5);
  EXPECT_NEAR(forward.y(), 0.0, 1e-12);
  const Eigen::Vector3d left = hover_force(with("rotor_tilt", 1.0, {{"towards_deg", 90.0}}), kWeight_N);
  EXPECT_NEAR(left.y(), side_N, 1e-5);
  EXPECT_NEAR(left.x(), 0.0, 1e-12);
}
TEST(RotorTilt, TurnsTheNamedRotorAloneAndYawsByItsArm) {
  for (int n = 1; n <= 4; ++n) {
    const PlantSetup s = with("rotor_tilt", 2.0, {{"rotor", n}});
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(s.body.rotors[i].tilt_rad.norm() > 0.0, i + 1 == static_cast<std::size_t>(n));
    const Eigen::Vector3d arm = s.body.rotors[static_cast<std::size_t>(n - 1)].hub_m;
    EXPECT_NEAR(hover_moment(s, kWeight_N).z(), -arm.y() * kWeight_N / 4.0 * 0.0349, 2e-6);
  }
}

TEST(RotorPlaneHeight, MovesAllHubsAlongZ) {
  const PlantSetup s = with("rotor_plane_height", 0.02);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_LT((s.body.rotors[i].hub_m - reference_body().rotors[i].hub_m - Eigen::Vector3d(0, 0, 0.02)).norm(), 1e-15);
}
TEST(RotorPlaneHeight, MakesRotorDragPitchTheNoseUpByForceTimesHeight) {
  FourLoads loads{};
  for (RotorLoads& l : loads) l.force_R_N.x() = -0.25;  // 1 N against forward flight
  const auto pitch = [&](const PlantSetup& s) {
    Airframe a(s.body, at_height(10.0));
    a.step(loads, Four{}, Four{});
    return a.wrench().rotor_moment_B_N_m.y();
  };
  EXPECT_NEAR(pitch(with("rotor_plane_height", 0.02)) - pitch(reference_setup()), -0.02, 1e-12) << "-y is nose up";
}

}  // namespace
}  // namespace rotorloop::sim
