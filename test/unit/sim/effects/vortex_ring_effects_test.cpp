// The vortex ring state: thrust lost and thrust that wanders, inside the ring alone.
#include <gtest/gtest.h>

#include <cmath>

#include "test/unit/sim/effects/vehicle.hpp"

namespace rotorloop::sim {
namespace {
using namespace test;

double loss(double share, const Eigen::Vector3d& v_m_s) { return 1.0 - thrust_ratio(*prepared("vortex_ring_loss", share), flying(v_m_s)); }

// v_h is about 7.6 m/s.
TEST(VortexRingLoss, BeginsBelow3p4MetresPerSecondOfDescentPeaksNear7p6AndEndsBefore14) {
  EXPECT_EQ(loss(0.2, {0, 0, -2.0}), 0.0);
  EXPECT_GT(loss(0.2, {0, 0, -3.4}), 0.02);
  double peak = 0.0;
  for (double descent = 6.0; descent < 9.0; descent += 0.05) peak = std::max(peak, loss(0.2, {0, 0, -descent}));
  EXPECT_NEAR(peak, 0.2, 0.001);
  EXPECT_EQ(loss(0.2, {0, 0, -14.0}), 0.0);
}
TEST(VortexRingLoss, NeverActsInHoverClimbOrLevelFlight) {
  for (const Eigen::Vector3d& v : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0, 0, 7), Eigen::Vector3d(8.5, 0, 0)})
    EXPECT_EQ(loss(0.4, v), 0.0);
}
TEST(VortexRingLoss, IsBlownAwayByEdgewiseFlow) {
  EXPECT_LT(loss(0.2, {3, 0, -6}), loss(0.2, {0, 0, -6}));
  EXPECT_NEAR(loss(0.2, {3, 0, -6}), loss(0.2, {0, -3, -6}), 1e-3) << "from ahead or from the side";
  EXPECT_EQ(loss(0.2, {8, 0, -6}), 0.0);
}
// At a given thrust: the solve itself has steps in descents beyond 9 m/s, where blade roots have two solutions.
TEST(VortexRingLoss, HasNoStepsInDescentSpeed) {
  const auto effect = prepared("vortex_ring_loss", 0.2);
  double before_N = kHoverThrust_N;
  for (double descent = 1.0; descent < 15.0; descent += 0.01) {
    const BodyMotion m = flying({0, 0, -descent});
    RotorSite s = site(0, m);
    s.bare = some_loads();
    s.bare.force_R_N.z() = kHoverThrust_N;
    RotorLoads l = s.bare;
    effect->rotor_loads(s, l);
    ASSERT_LT(std::fabs(thrust_N(l) - before_N), 1e-3) << descent;
    before_N = thrust_N(l);
  }
}
TEST(VortexRingLoss, IsInProportionToItsParameterAndLeavesTorqueAndInPlaneForce) {
  const BodyMotion m = flying({1, 0, -6});
  EXPECT_NEAR(loss(0.4, m.v_W_m_s), 2.0 * loss(0.2, m.v_W_m_s), 1e-12);
  EXPECT_EQ(largest_change_beside_thrust(loads_with(*prepared("vortex_ring_loss", 0.4), site(0, m)), solved(site(0, m))), 0.0);
}

// Thrust over that of the solve, less 1, of rotors 1 and 2 in the middle of the ring, every 10 ms.
std::array<std::vector<double>, 2> wander(double sigma, std::uint64_t seed, std::size_t count, double descent_m_s = 7.6) {
  const auto effect = make("vortex_ring_fluctuation", sigma);
  PlantSetup setup = reference_setup();
  setup.seed = seed;
  effect->prepare(setup);
  const BodyMotion m = flying({0, 0, -descent_m_s});
  std::array<RotorSite, 2> sites{site(0, m), site(1, m)};
  for (RotorSite& s : sites) s.bare = solved(s);
  std::array<std::vector<double>, 2> out;
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < 2; ++i) {
      RotorLoads l = sites[i].bare;
      effect->rotor_loads(sites[i], l);
      out[i].push_back(thrust_N(l) / thrust_N(sites[i].bare) - 1.0);
    }
    effect->advance(m, 0.01);
  }
  return out;
}
double mean_product(const std::vector<double>& a, const std::vector<double>& b, std::size_t lag) {
  double total = 0.0;
  for (std::size_t k = lag; k < a.size(); ++k) total += a[k - lag] * b[k];
  return total / static_cast<double>(a.size() - lag);
}
TEST(VortexRingFluctuation, HasTheDeviationSigmaAndTheCorrelationTimeTauEachRotorForItself) {
  const auto n = wander(0.1, 1, 100'000);  // 1000 s, 10 000 correlation times
  const double variance = mean_product(n[0], n[0], 0);
  EXPECT_NEAR(std::sqrt(variance), 0.1, 0.005);
  EXPECT_NEAR(mean_product(n[0], n[0], 10) / variance, std::exp(-1.0), 0.04) << "lag of 0.1 s";
  EXPECT_NEAR(mean_product(n[0], n[1], 0) / variance, 0.0, 0.05);
}
TEST(VortexRingFluctuation, RepeatsWithItsSeedAndChangesWithIt) {
  EXPECT_EQ(wander(0.1, 5, 200), wander(0.1, 5, 200));
  EXPECT_NE(wander(0.1, 5, 200), wander(0.1, 6, 200));
}
TEST(VortexRingFluctuation, IsSilentOutsideTheRing) {
  for (const double descent : {-5.0, 0.0, 2.0, 14.0}) {
    const auto n = wander(0.3, 1, 50, descent);
    EXPECT_EQ(n[0], std::vector<double>(50, 0.0)) << descent;
  }
}

}  // namespace
}  // namespace rotorloop::sim
