// What other programs recorded, against ours. The recordings live in the data folder; without it the tests are skipped and counted.
// docs/acceptance/rotor_oracles.md discusses every figure.
#include "bench/propeller/oracles/oracles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
class Oracle : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("ROTORLOOP_DATA");
    if (folder == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set: recorded results of other codes not compared";
    data_ = folder;
  }
  void judge(const std::vector<OracleRow>& rows, std::size_t least_judged) {
    std::printf("%s", oracle_table(rows).c_str());
    std::size_t judged = 0;
    for (const OracleRow& r : rows) {
      if (!r.judged()) continue;
      ++judged;
      EXPECT_TRUE(std::isfinite(r.deviation) && r.met())
          << r.source << ", " << r.condition << ", " << r.quantity << ": " << r.ours << " against " << r.recorded;
    }
    EXPECT_GE(judged, least_judged);
  }
  std::filesystem::path data_;
};

TEST_F(Oracle, CirculationFormGivesQpropsThrustTorqueAndStationsWithin2Percent) { judge(qprop_oracle(data_), 16); }
TEST_F(Oracle, UniformInflowGivesAgiliciousLoadsAndInducedVelocityWithin2point5Percent) { judge(agilicious_oracle(data_), 48); }
TEST_F(Oracle, LinearBladeGivesJsbsimsRotorInflowThrustAndTorqueWithin2point5Percent) { judge(jsbsim_rotor_oracle(data_), 30); }
TEST_F(Oracle, MomentumAndMotorGiveJsbsimsInducedVelocityTorqueAndSettledSpeedWithin2point5Percent) {
  judge(jsbsim_drive_oracle(data_), 18);
}
TEST_F(Oracle, RigidBodyGivesRotorpysAndAgiliciousAccelerationsWithin1e6) { judge(rigid_body_oracle(data_), 33); }

// Each limit notices what it stands for: with one choice of the other program left out, this quantity misses.
double worst(const std::vector<OracleRow>& rows, const std::string& quantity) {
  double most = 0.0;
  for (const OracleRow& r : rows)
    if (r.quantity == quantity) most = std::max(most, std::fabs(r.deviation));
  std::printf("[ ablation ] %s: %.2f %%\n", quantity.c_str(), 100 * most);
  return most;
}
TEST_F(Oracle, WithoutTipLossOrCompressibilityQpropsThrustIsMissed) {
  EXPECT_GT(worst(qprop_oracle(data_, [](auto& c) { c.edge_loss = sim::EdgeLoss::none; }), "thrust, N"), 0.04);
  EXPECT_GT(worst(qprop_oracle(data_, [](auto& c) { c.compressibility = false; }), "thrust, N"), 0.01);
}
TEST_F(Oracle, WithoutItsConstantsSwirlOrDescentLawAgiliciousIsMissed) {
  EXPECT_GT(worst(agilicious_oracle(data_, [](auto& c) { c.in_plane_factor = 1.0; }), "in-plane force x 3, N"), 0.6);
  EXPECT_GT(worst(agilicious_oracle(data_, [](auto& c) { c.swirl = true; }), "thrust, N"), 0.05);
  EXPECT_GT(worst(agilicious_oracle(data_, [](auto& c) { c.descent = sim::Descent::momentum; }), "induced velocity, m/s"), 0.04);
}
TEST_F(Oracle, WithSwirlOrTheEmpiricalRingJsbsimsRotorIsMissed) {
  EXPECT_GT(worst(jsbsim_rotor_oracle(data_, [](auto& c) { c.swirl = true; }), "C_T at the recorded inflow"), 0.025);
  EXPECT_GT(worst(jsbsim_rotor_oracle(data_, [](auto& c) { c.descent = sim::Descent::ring; }), "settled induced inflow nu"), 0.025);
}

TEST(OracleFiles, AMissingRecordingIsNamed) {
  try {
    agilicious_oracle("/nowhere");
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("agilicious_bem.json"), std::string::npos) << e.what();
  }
}
TEST(OracleRows, AMissIsMarkedAndAnUnjudgedRowIsNot) {
  const OracleRow miss{"code", "hover", "thrust, N", 1.0, 1.1, 0.1, 0.02, ""},
      information{"code", "hover", "thrust, N", 1.0, 1.1, 0.1, 0.0, ""};
  EXPECT_FALSE(miss.met());
  EXPECT_TRUE(information.met());
  EXPECT_NE(oracle_table({miss}).find("MISSED"), std::string::npos);
  EXPECT_EQ(oracle_table({information}).find("MISSED"), std::string::npos);
}
}  // namespace
}  // namespace rotorloop::propeller
