// Ground and ceiling: sizes of the published laws, limits, and the moments of a vehicle that is not level.
#include <gtest/gtest.h>

#include "sim/plant/flight_dynamics.hpp"
#include "test/unit/sim/effects/vehicle.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

const double kR_m = rotor().radius_m();
// Body height at which the hubs are `radii` above the ground at z = 0.
BodyMotion above_ground(double radii, const Eigen::Vector3d& v_m_s = {0, 0, 0}) { return flying(v_m_s, radii * kR_m - kHeight_m); }
double gain_of(Effect& effect, const BodyMotion& m) { return thrust_ratio(effect, m) - 1.0; }

TEST(GroundEffectRotor, RaisesThrustByAbout6p7And1p6And0p7PercentAtOneTwoAndThreeRadii) {
  const auto effect = prepared("ground_effect_rotor", 1.0);
  EXPECT_NEAR(gain_of(*effect, above_ground(1)), 0.067, 0.0005);
  EXPECT_NEAR(gain_of(*effect, above_ground(2)), 0.016, 0.0005);
  EXPECT_NEAR(gain_of(*effect, above_ground(3)), 0.007, 0.0005);
  EXPECT_LT(gain_of(*effect, above_ground(100)), 1e-5);
}
TEST(GroundEffectRotor, FallsSteadilyWithHeightAndHoldsBelowHalfARadius) {
  const auto effect = prepared("ground_effect_rotor", 1.0);
  for (double radii = 0.5; radii < 6.0; radii += 0.1)
    EXPECT_GT(gain_of(*effect, above_ground(radii)), gain_of(*effect, above_ground(radii + 0.1))) << radii;
  EXPECT_EQ(gain_of(*effect, above_ground(0.1)), gain_of(*effect, above_ground(0.5)));
}
TEST(GroundEffectRotor, FadesWithForwardSpeedAndScalesWithItsGain) {
  const auto effect = prepared("ground_effect_rotor", 1.0), twice = prepared("ground_effect_rotor", 2.0);
  const double hover = gain_of(*effect, above_ground(1));
  EXPECT_NEAR(gain_of(*effect, above_ground(1, {8.5, 0, 0})) / hover, 0.37, 0.05) << "v_i is 6.6 m/s there";
  EXPECT_NEAR(gain_of(*effect, above_ground(1, {0, 8.5, 0})), gain_of(*effect, above_ground(1, {8.5, 0, 0})), 1e-9);
  EXPECT_NEAR(gain_of(*twice, above_ground(2)) / gain_of(*effect, above_ground(2)), 2.0, 0.05);
}
TEST(GroundEffectRotor, MeasuresFromTheGroundOfThePlantAndLeavesTorqueAndInPlaneForce) {
  const auto effect = make("ground_effect_rotor", 1.0);
  PlantSetup setup = reference_setup();
  setup.body.ground_z_m = -2.0;
  effect->prepare(setup);
  BodyMotion m = above_ground(1, {2, 0, 0});
  m.p_W_m.z() -= 2.0;
  EXPECT_NEAR(gain_of(*effect, m), gain_of(*prepared("ground_effect_rotor", 1.0), above_ground(1, {2, 0, 0})), 1e-9);
  EXPECT_EQ(largest_change_beside_thrust(loads_with(*effect, site(0, m)), solved(site(0, m))), 0.0);
}

TEST(GroundEffectVehicle, RaisesThrustByAbout16And9And6And2p6PercentAtOneTwoThreeAndFiveRadii) {
  const auto effect = prepared("ground_effect_vehicle", 1.0);
  EXPECT_NEAR(gain_of(*effect, above_ground(1)), 0.16, 0.01);
  EXPECT_NEAR(gain_of(*effect, above_ground(2)), 0.09, 0.01);
  EXPECT_NEAR(gain_of(*effect, above_ground(3)), 0.06, 0.01);
  EXPECT_NEAR(gain_of(*effect, above_ground(5)), 0.026, 0.005);
}
TEST(GroundEffectVehicle, ExceedsASingleRotorByTheImagesOfTheOthersAndTheFountain) {
  const auto alone = prepared("ground_effect_rotor", 1.0), images = prepared("ground_effect_vehicle", 1.0, {{"fountain", 0.0}});
  const auto all = prepared("ground_effect_vehicle", 1.0);
  for (const double radii : {1.0, 2.0, 4.0}) {
    EXPECT_GT(gain_of(*images, above_ground(radii)), gain_of(*alone, above_ground(radii)));
    EXPECT_GT(gain_of(*all, above_ground(radii)), gain_of(*images, above_ground(radii)));
  }
}
TEST(GroundEffectVehicle, LiftsALevelVehicleWithoutMomentAndTurnsATiltedOneUpright) {
  const auto effect = prepared("ground_effect_vehicle", 1.0);
  BodyMotion m = above_ground(2);
  const auto moment = [&] { return Eigen::Vector3d(sum(four_loads(*effect, m)).moment_B_N_m - sum(four_bare_loads(m)).moment_B_N_m); };
  EXPECT_LT(moment().norm(), 1e-9);
  m.R_WB = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const double roll_N_m = moment().x();
  EXPECT_LT(roll_N_m, -1e-3) << "right side low: rolled back to the left";
  EXPECT_NEAR(moment().y(), 0.0, 1e-9);
  m.R_WB = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_NEAR(moment().y(), roll_N_m, 1e-6) << "nose low: the same upwards";
  m.R_WB = Eigen::AngleAxisd(-0.2, Eigen::Vector3d::UnitX()).toRotationMatrix();
  EXPECT_NEAR(moment().x(), -roll_N_m, 1e-9);
}
TEST(GroundEffectVehicle, VanishesHighUpAndInFastFlightAndLeavesTorqueAndInPlaneForce) {
  const auto effect = prepared("ground_effect_vehicle", 1.0);
  EXPECT_LT(gain_of(*effect, above_ground(100)), 2e-4);
  EXPECT_LT(gain_of(*effect, above_ground(1, {12, 0, 0})), 0.25 * gain_of(*effect, above_ground(1)));
  const BodyMotion m = above_ground(1, {2, 0, 0});
  EXPECT_EQ(largest_change_beside_thrust(loads_with(*effect, site(0, m)), solved(site(0, m))), 0.0);
}

// Hubs, not the centre of mass, are what stands above the ground, whichever other effect has moved one against the other.
TEST(GroundEffectVehicle, FollowsTheTrueHeightOfTheHubsWhenAnotherEffectMovesThemOrTheCentreOfMass) {
  const auto thrust_of = [](std::string_view other, double value, const Eigen::Vector3d& com_m, double hubs_above_com_m) {
    EffectSet effects;
    effects.add("ground_effect_vehicle", 1.0);
    if (!other.empty()) effects.add(other, effect_values(*find_effect(other), value));
    PlantSetup setup = reference_setup();
    effects.prepare(setup);
    EXPECT_LT((setup.body.com_offset_m - com_m).norm(), 1e-12);
    AirframeState hover;
    hover.p_W_m.z() = 1.5 * kR_m - hubs_above_com_m;
    FlightDynamics flight(setup, {&rotor(), &rotor(), &rotor(), &rotor()}, std::move(effects), hover);
    std::array<double, 4> omega{};
    omega.fill(hover_omega());
    flight.evaluate_rotors(omega);
    return thrust_N(flight.loads()[0]);
  };
  const double plain_N = thrust_of("", 0.0, Eigen::Vector3d::Zero(), kHeight_m);
  EXPECT_NEAR(thrust_of("rotor_plane_height", 0.03, Eigen::Vector3d::Zero(), kHeight_m + 0.03) / plain_N, 1.0, 1e-12);
  const double z_m = -0.04 * 0.4 / (0.4 + kMass_kg);
  EXPECT_NEAR(thrust_of("payload_mass", 0.4, {0.0, 0.0, z_m}, kHeight_m - z_m) / plain_N, 1.0, 1e-12);
}

BodyMotion below_ceiling(double radii, double ceiling_z_m = 3.0) { return flying({0, 0, 0}, ceiling_z_m - radii * kR_m - kHeight_m); }
TEST(CeilingEffect, SucksUpBySeveralPercentWithinTwoRadiiAndByNothingBeyondTen) {
  const auto effect = prepared("ceiling_effect", 1.0);
  EXPECT_NEAR(gain_of(*effect, below_ceiling(1)), 0.067, 0.001);
  EXPECT_NEAR(gain_of(*effect, below_ceiling(2)), 0.016, 0.001);
  EXPECT_LT(gain_of(*effect, below_ceiling(10)), 1e-3);
  EXPECT_NEAR(gain_of(*effect, below_ceiling(0.2)), gain_of(*effect, below_ceiling(0.5)), 1e-12) << "held";
  EXPECT_EQ(gain_of(*effect, flying({0, 0, 0}, 5.0)), 0.0) << "above the ceiling";
}
TEST(CeilingEffect, FollowsTheHeightOfTheCeilingAndItsGain) {
  EXPECT_NEAR(gain_of(*prepared("ceiling_effect", 1.0, {{"ceiling_z_m", 2.2}}), below_ceiling(1, 2.2)), 0.067, 0.001);
  EXPECT_NEAR(gain_of(*prepared("ceiling_effect", 0.5), below_ceiling(1)), 0.5 * 0.067, 0.002);
}

}  // namespace
}  // namespace rotorloop::sim
