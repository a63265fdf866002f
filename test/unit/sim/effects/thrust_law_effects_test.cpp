// Thrust that differs from what was measured: by a factor, or by a power of rotor speed. And both in a whole flight.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/plant/flight_dynamics.hpp"
#include "test/unit/sim/effects/vehicle.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

TEST(ThrustScale, ScalesTheThrustAndTheTorqueOnlyWhenAsked) {
  const BodyMotion m = some_motion();
  for (std::size_t i = 0; i < 4; ++i) {
    const RotorLoads bare = solved(site(i, m)), alone = loads_with(*prepared("thrust_scale", 0.9), site(i, m));
    EXPECT_NEAR(thrust_N(alone), 0.9 * thrust_N(bare), 1e-15);
    EXPECT_EQ(largest_change_beside_thrust(alone, bare), 0.0);
    const RotorLoads both = loads_with(*prepared("thrust_scale", 0.9, {{"with_torque", 1.0}}), site(i, m));
    EXPECT_EQ(thrust_N(both), thrust_N(alone));
    EXPECT_NEAR(both.shaft_torque_N_m, 0.9 * bare.shaft_torque_N_m, 1e-15);
    EXPECT_NEAR(both.moment_R_N_m.z(), 0.9 * bare.moment_R_N_m.z(), 1e-15) << "reaction of rotor " << i;
  }
}

double at_speed(double exponent, double omega_rad_s, double omega_0_rad_s = 945.0) {
  const BodyMotion m = flying({0, 0, 0});
  const auto effect = prepared("thrust_speed_exponent", exponent, {{"omega_0_rad_s", omega_0_rad_s}});
  return thrust_N(loads_with(*effect, site(0, m, omega_rad_s))) / thrust_N(solved(site(0, m, omega_rad_s)));
}
TEST(ThrustSpeedExponent, TurnsTheThrustAboutItsReferenceSpeed) {
  EXPECT_EQ(at_speed(0.3, 945), 1.0);
  EXPECT_NEAR(at_speed(0.3, 1200), std::pow(1200.0 / 945.0, 0.3), 1e-12);
  EXPECT_NEAR(at_speed(-0.3, 1200), std::pow(1200.0 / 945.0, -0.3), 1e-12);
  EXPECT_NEAR(at_speed(0.3, 1200, 1200), 1.0, 1e-12);
}
TEST(ThrustSpeedExponent, Of0p05IsTheMeasuredGrowthOf9PercentFrom1400To7000Rpm) {
  EXPECT_NEAR(at_speed(0.05, 7000 * kRpm) / at_speed(0.05, 1400 * kRpm), 1.09, 0.01);
}
TEST(ThrustSpeedExponent, StaysFiniteOnAStandingRotor) {
  const BodyMotion m = flying({0, 0, 0});
  for (const double omega : {0.0, 1.0, 20.0})
    EXPECT_TRUE(std::isfinite(thrust_N(loads_with(*prepared("thrust_speed_exponent", -0.5), site(0, m, omega)))));
}

// Rotor 1's thrust after some steps of level flight at 8.5 m/s; shafts at hover speed.
double thrust_in_flight(EffectSet effects) {
  PlantSetup setup = reference_setup();
  effects.prepare(setup);
  AirframeState start = at_height(10.0);
  start.v_W_m_s = {8.5, 0, 0};
  FlightDynamics flight(setup, {&rotor(), &rotor(), &rotor(), &rotor()}, std::move(effects), start);
  std::array<double, 4> omega{}, omega_dot{};
  omega.fill(hover_omega());
  flight.evaluate_rotors(omega);
  for (int k = 0; k < 3; ++k) {
    flight.step(omega_dot);
    flight.evaluate_rotors(omega);
  }
  return thrust_N(flight.loads()[0]);
}
TEST(RotorEffectsInFlight, DifferencesOfTwoSolvesStartFromTheBareLoadsWhateverElseIsOn) {
  EffectSet none, axial, all;
  axial.add("translational_lift", 0.0);
  all.add("translational_lift", 0.0);
  all.add("blockage_strut", 0.1);
  all.add("thrust_scale", 1.1);
  all.add("dynamic_inflow", 1.0);
  const double with_N = thrust_in_flight(std::move(none)), without_N = thrust_in_flight(std::move(axial));
  EXPECT_NEAR(with_N / without_N - 1.0, 0.11, 0.02);
  EXPECT_NEAR(thrust_in_flight(std::move(all)) / without_N, 0.9 * 1.1, 1e-3);
}

}  // namespace
}  // namespace rotorloop::sim
