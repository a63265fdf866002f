// Rotors in each other's wakes: pitch-up in forward flight, loss in hover.
#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "test/unit/sim/effects/vehicle.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

// Loads in the second step: in the first the wakes are not known yet.
FourRotorLoads in_wakes(double kappa, const BodyMotion& m) {
  const auto effect = prepared("rotor_wake_interference", kappa);
  four_loads(*effect, m);
  return four_loads(*effect, m);
}
Eigen::Vector3d added_moment(double kappa, const Eigen::Vector3d& v_m_s) {
  const BodyMotion m = flying(v_m_s);
  return sum(in_wakes(kappa, m)).moment_B_N_m - sum(four_bare_loads(m)).moment_B_N_m;
}

TEST(RotorWakeInterference, LiftsTheSideThatFliesAhead) {
  EXPECT_LT(added_moment(0.3, {8.5, 0, 0}).y(), -5e-3) << "forward: nose up, a moment along -y";
  EXPECT_GT(added_moment(0.3, {-8.5, 0, 0}).y(), 5e-3) << "backward: tail up";
  EXPECT_GT(added_moment(0.3, {0, 8.5, 0}).x(), 5e-3) << "to the left: left side up";
  EXPECT_LT(added_moment(0.3, {0, -8.5, 0}).x(), -5e-3);
}
TEST(RotorWakeInterference, PitchesUpBy19To57MillinewtonmetresAt8p5MetresPerSecond) {
  for (const double kappa : {0.3, 0.35, 0.5}) {
    EXPECT_LT(added_moment(kappa, {8.5, 0, 0}).y(), -0.019) << kappa;
    EXPECT_GT(added_moment(kappa, {8.5, 0, 0}).y(), -0.057) << kappa;
  }
}
TEST(RotorWakeInterference, HasNoPreferredHeading) {
  const double c = std::numbers::sqrt2 / 2.0;
  const double ahead = added_moment(0.3, {8.5, 0, 0}).head<2>().norm();
  EXPECT_NEAR(added_moment(0.3, {0, 8.5, 0}).head<2>().norm(), ahead, 1e-6);
  EXPECT_NEAR(added_moment(0.3, {8.5 * c, 8.5 * c, 0}).head<2>().norm() / ahead, 1.0, 0.1);
}
TEST(RotorWakeInterference, TakesThrustFromTheRearRotorsAlone) {
  const BodyMotion m = flying({8.5, 0, 0});
  const FourRotorLoads with = in_wakes(0.3, m), bare = four_bare_loads(m);
  for (const std::size_t front : {0u, 2u}) EXPECT_EQ(with[front].force_R_N, bare[front].force_R_N);
  for (const std::size_t rear : {1u, 3u}) EXPECT_LT(thrust_N(with[rear]), 0.97 * thrust_N(bare[rear]));
  EXPECT_NEAR(thrust_N(with[1]), thrust_N(with[3]), 1e-9) << "left and right alike";
  EXPECT_NEAR(added_moment(0.3, {8.5, 0, 0}).x(), 0.0, 1e-9);
  EXPECT_NEAR(added_moment(0.3, {8.5, 0, 0}).z(), 0.0, 1e-9) << "one rear rotor of each spin";
}
TEST(RotorWakeInterference, VanishesInHoverAndVerticalFlightAndGrowsWithKappaAndSpeed) {
  for (const double climb : {-2.0, 0.0, 3.0}) EXPECT_EQ(added_moment(0.5, {0, 0, climb}).norm(), 0.0);
  EXPECT_NEAR(added_moment(0.4, {8.5, 0, 0}).y() / added_moment(0.2, {8.5, 0, 0}).y(), 2.0, 0.2);
  EXPECT_LT(added_moment(0.3, {4, 0, 0}).y(), added_moment(0.3, {1, 0, 0}).y());
}

// Thrust of each rotor over that without the effect, in the second step.
std::array<double, 4> behind_wakes(double loss, const Eigen::Vector3d& v_m_s) {
  const auto effect = prepared("rotor_wake_thrust_loss", loss);
  const BodyMotion m = flying(v_m_s);
  four_loads(*effect, m);
  const FourRotorLoads with = four_loads(*effect, m), bare = four_bare_loads(m);
  std::array<double, 4> out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = thrust_N(with[i]) / thrust_N(bare[i]);
  return out;
}

TEST(RotorWakeThrustLoss, TakesAShareOfThrustFromTheRotorsBehindAndTheirTorqueStays) {
  const auto forward = behind_wakes(0.1, {8.5, 0, 0});
  for (const std::size_t front : {0u, 2u}) EXPECT_DOUBLE_EQ(forward[front], 1.0);
  for (const std::size_t rear : {1u, 3u}) {
    EXPECT_LT(forward[rear], 0.96);
    EXPECT_GT(forward[rear], 0.90);
  }
  EXPECT_NEAR(forward[1], forward[3], 1e-9) << "left and right alike";
  const auto effect = prepared("rotor_wake_thrust_loss", 0.1);
  const BodyMotion m = flying({8.5, 0, 0});
  four_loads(*effect, m);
  EXPECT_EQ(largest_change_beside_thrust(loads_with(*effect, site(1, m)), solved(site(1, m))), 0.0);
}
TEST(RotorWakeThrustLoss, OneRotorAloneFliesInTheWakeAlongADiagonal) {
  const double c = std::numbers::sqrt2 / 2.0;
  const auto diagonal = behind_wakes(0.1, {8.5 * c, 8.5 * c, 0});
  EXPECT_LT(diagonal[3], 0.97);
  EXPECT_GT(diagonal[0], 0.99) << "beside the track";
  EXPECT_GT(diagonal[1], 0.99);
  EXPECT_DOUBLE_EQ(diagonal[2], 1.0);
}
TEST(RotorWakeThrustLoss, VanishesInHoverAndVerticalFlightAndGrowsWithSpeedToTheWholeLoss) {
  for (const double climb : {-2.0, 0.0, 3.0}) EXPECT_DOUBLE_EQ(behind_wakes(0.5, {0, 0, climb})[1], 1.0) << climb;
  const double slow = 1.0 - behind_wakes(0.1, {2, 0, 0})[1], middle = 1.0 - behind_wakes(0.1, {6, 0, 0})[1],
               fast = 1.0 - behind_wakes(0.1, {30, 0, 0})[1];
  EXPECT_LT(slow, 0.5 * middle);
  EXPECT_LT(middle, fast);
  EXPECT_NEAR(fast, 0.1, 0.005);
  EXPECT_NEAR(1.0 - behind_wakes(0.2, {6, 0, 0})[1], 2.0 * middle, 1e-9) << "in proportion to the loss";
}

// Thrust of each rotor over that without the effect, in the second step.
std::array<double, 4> shares(double lateral, double longitudinal, double diagonal, const Eigen::Vector3d& v_m_s) {
  const auto effect = make("rotor_pair_interaction", lateral, {{"kappa_longitudinal", longitudinal}, {"kappa_diagonal", diagonal}});
  PlantSetup setup = reference_setup();
  effect->prepare(setup);
  const BodyMotion m = flying(v_m_s);
  four_loads(*effect, m);
  const FourRotorLoads with = four_loads(*effect, m), bare = four_bare_loads(m);
  std::array<double, 4> out{};
  for (std::size_t i = 0; i < 4; ++i) out[i] = thrust_N(with[i]) / thrust_N(bare[i]);
  return out;
}
constexpr std::size_t kFrontRight = 0, kRearLeft = 1, kFrontLeft = 2, kRearRight = 3;

TEST(RotorPairInteraction, LateralPairsActInSidewaysFlightOnTheRotorsBehindAlone) {
  const auto left = shares(0.3, 0.0, 0.0, {0, 8.5, 0});
  for (const std::size_t behind : {kFrontRight, kRearRight}) EXPECT_LT(left[behind], 0.97);
  for (const std::size_t ahead : {kFrontLeft, kRearLeft}) EXPECT_DOUBLE_EQ(left[ahead], 1.0);
  EXPECT_NEAR(shares(0.3, 0.0, 0.0, {0, -8.5, 0})[kFrontLeft], left[kFrontRight], 1e-9) << "mirrored";
  for (const double share : shares(0.3, 0.0, 0.0, {8.5, 0, 0})) EXPECT_DOUBLE_EQ(share, 1.0) << "nothing straight ahead";
}
TEST(RotorPairInteraction, LongitudinalPairsActInForwardFlightAndASignTurnsLossIntoGain) {
  const auto forward = shares(0.0, 0.3, 0.0, {8.5, 0, 0}), gain = shares(0.0, -0.3, 0.0, {8.5, 0, 0});
  for (const std::size_t rear : {kRearLeft, kRearRight}) {
    EXPECT_LT(forward[rear], 0.97);
    EXPECT_GT(gain[rear], 1.03);
  }
  for (const std::size_t front : {kFrontLeft, kFrontRight}) EXPECT_DOUBLE_EQ(forward[front], 1.0);
}
TEST(RotorPairInteraction, ADiagonalPairTurnsItsSignBeyond45DegreesFromItsLine) {
  const double c = std::numbers::sqrt2 / 2.0;
  const auto along = shares(0.0, 0.0, 0.3, {8.5 * c, 8.5 * c, 0});
  EXPECT_LT(along[kRearRight], 0.97) << "behind";
  EXPECT_GT(along[kFrontLeft], 1.03) << "ahead";
  EXPECT_NEAR(along[kFrontRight], 1.0, 1e-9) << "the other pair flies side by side";
  EXPECT_NEAR(shares(0.0, 0.0, 0.3, {8.5, 0, 0})[kRearRight], 1.0, 1e-9) << "at 45 degrees";
  EXPECT_LT(shares(0.0, 0.0, 0.3, {8.5 * 0.2, 8.5 * 0.98, 0})[kRearLeft], 0.999) << "57 degrees from its line: ahead, and loses";
  EXPECT_GT(shares(0.0, 0.0, 0.3, {-8.5 * 0.2, 8.5 * 0.98, 0})[kRearRight], 1.001) << "and the one behind gains";
}
TEST(RotorPairInteraction, VanishesInHoverAndVerticalFlight) {
  for (const double climb : {-2.0, 0.0, 3.0}) {
    for (const double share : shares(0.5, 0.5, 0.5, {0, 0, climb})) EXPECT_DOUBLE_EQ(share, 1.0) << climb;
  }
}

TEST(HoverInterference, TakesItsLossFromTheThrustOfHoverAndNothingElse) {
  const auto effect = prepared("hover_interference", 0.03);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(thrust_ratio(*effect, flying({0, 0, 0}), i), 0.97, 1e-12);
  const BodyMotion m = flying({2, 1, 0});
  EXPECT_EQ(largest_change_beside_thrust(loads_with(*effect, site(3, m)), solved(site(3, m))), 0.0);
}
TEST(HoverInterference, FadesWithEdgewiseSpeedInAnyDirection) {
  const auto effect = prepared("hover_interference", 0.1);
  EXPECT_NEAR(1.0 - thrust_ratio(*effect, flying({6.6, 0, 0})), 0.05, 0.01) << "half at V = v_i";
  EXPECT_LT(1.0 - thrust_ratio(*effect, flying({12, 0, 0})), 0.02);
  EXPECT_NEAR(thrust_ratio(*effect, flying({0, -6.6, 0})), thrust_ratio(*effect, flying({6.6, 0, 0})), 1e-9);
}

}  // namespace
}  // namespace rotorloop::sim
