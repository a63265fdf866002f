// The limits on measured propellers (docs/acceptance/rotor_validation.md). Needs the data folder; takes about 5 s.
#include <cstdio>
#include <cstdlib>

#include "bench/propeller/report/validation_output.hpp"
#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {

PropellerInputs inputs() {
  PropellerInputs in;
  in.data = std::getenv("ROTORLOOP_DATA");
  in.shipped_polars = ROTORLOOP_SOURCE_DIR "/vehicles/polars";
  return in;
}
std::vector<PropellerResult> validated(const PropellerInputs& in) {
  std::vector<PropellerResult> results;
  for (const auto& e : propeller_catalogue()) results.push_back(validate(read_measured_propeller(in, e)));
  return results;
}

class MeasuredPropellers : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_DATA") == nullptr)
      GTEST_SKIP() << "ROTORLOOP_DATA is not set: the BEM rotor model is not compared with measured propellers";
  }
};

void expect_limits(const std::vector<PropellerResult>& results) {
  const auto limits = judge(results);
  ASSERT_EQ(limits.size(), 11u);
  for (const ValidationLimit& l : limits) {
    EXPECT_TRUE(l.pass) << l.name << ": " << 100 * l.measured << " %, limit " << 100 * l.limit << " %";
    std::printf("[ measured ] %s: %.1f %%\n", l.name.c_str(), 100 * l.measured);
  }
}
TEST_F(MeasuredPropellers, HeldOutStaticWithin4And7p5PercentAndMostSweepsWithin8And10) { expect_limits(validated(inputs())); }
TEST_F(MeasuredPropellers, DragOfDelayedStallKeepsTheLimitsAndBringsStaticPowerOfTheRigidDa4002Within3Percent) {
  PropellerInputs in = inputs();
  in.stall_drag = 1.0;
  const auto results = validated(in);
  expect_limits(results);
  for (const PropellerResult& p : results)
    if (p.propeller.entry.key.starts_with("da4002"))
      for (const SetScore& s : p.geometries.front().scores)
        if (s.is_static && s.part == Part::held_out) {
          EXPECT_LT(s.fitted.cp, 0.03) << p.propeller.entry.title;
        }
}
// Four scalars within physical bounds cannot make a wrong blade right.
TEST_F(MeasuredPropellers, BladeWithTheTwistOfAnotherPropellerMissesTheLimits) {
  MeasuredPropeller p = read_measured_propeller(inputs(), propeller_catalogue()[2]);  // DA4002 5x3.75
  for (auto& s : p.geometries.front().blade.stations) s.twist_deg -= 8.0;
  EXPECT_FALSE(all_pass(judge({validate(p)})));
}
TEST_F(MeasuredPropellers, EveryPolarOfTheDataFolderBecomesAFullCircle) {
  for (const char* name : {"clark_y", "naca4412", "eppler_e63"}) {
    PropellerInputs in = inputs();
    in.section = name;
    const auto p = read_measured_propeller(in, propeller_catalogue().front());
    const sim::Polar& polar = p.geometries.front().blade.polars.begin()->second;
    EXPECT_EQ(polar.tables.front().reynolds, 30e3) << name;
    EXPECT_EQ(polar.alpha_deg.front(), -180.0) << name;
  }
}
TEST_F(MeasuredPropellers, FolderWithoutThePropellersIsBadDataWithARemedy) {
  PropellerInputs in = inputs();
  in.data = ROTORLOOP_SOURCE_DIR;
  try {
    read_measured_propeller(in, propeller_catalogue().front());
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::data_quality);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("ROTORLOOP_DATA"));
  }
}
TEST(MeasuredPropellersInput, MisspeltSectionNamesBothPlacesWhereItWasLookedFor) {
  if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set";
  PropellerInputs in = inputs();
  in.section = "nasa4412";
  EXPECT_THAT(
      fixtures::message([&] { read_measured_propeller(in, propeller_catalogue().front()); }),
      ::testing::AllOf(::testing::HasSubstr("nasa4412_Re*.txt"), ::testing::HasSubstr("nasa4412.toml"), ::testing::HasSubstr("--section")));
}

}  // namespace
}  // namespace rotorloop::propeller
