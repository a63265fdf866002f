#include "bench/hil/closed_loop/plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

using ::testing::HasSubstr;

constexpr const char* kPlan = R"(format = 1
name = "aft-rotor wake"
plant = "plant.toml"
vehicle = "vehicle.toml"
[controller]
gains = "gains.toml"
[seeds]
learn = [201]
held_out = [301]
judged = [1, 2, 3]
[[undeclared]]
id = "rotor_wake_interference"
kappa = 0.35
[[learn]]
name = "slow"
trajectory = "t.toml"
role = "horizontal"
[[held_out]]
name = "slow"
trajectory = "t.toml"
[[judged]]
name = "fast"
trajectory = "t.toml"
expect = "better"
percent = 10
[[judged]]
name = "hover"
trajectory = "t.toml"
expect = "no_worse"
axis = "z"
)";

struct PlanTest : ::testing::Test {
  test::TempFolder folder;
  LoopPlan read(const std::string& text) {
    for (const char* f : {"plant.toml", "vehicle.toml", "gains.toml", "t.toml"}) folder.write(f, "");
    return read_loop_plan(folder.write("plan.toml", text));
  }
  std::string error(const std::string& from, const std::string& to) {
    std::string text = kPlan;
    text.replace(text.find(from), from.size(), to);
    return test::error_of([&] { read(text); });
  }
};

TEST_F(PlanTest, SaysWhatIsHiddenWhatIsLearntFromAndWhatIsJudgedHow) {
  const auto p = read(kPlan);
  ASSERT_EQ(p.injected.size(), 1u);
  EXPECT_EQ(p.injected[0].id, "rotor_wake_interference");
  EXPECT_EQ(p.injected[0].values, (std::vector<std::pair<std::string, double>>{{"kappa", 0.35}}));
  EXPECT_EQ(p.learn.at(0).role, "horizontal");
  EXPECT_EQ(p.variant, host::Variant::pd_ff_thrust_drag);
  ASSERT_EQ(p.judged.size(), 2u);
  EXPECT_EQ(p.judged[0].expect, Expectation::better);
  EXPECT_EQ(p.judged[0].percent, 10.0);
  EXPECT_EQ(p.judged[1].axis, hil::ErrorAxis::z);
  EXPECT_EQ(p.judged[1].percent, 5.0) << "a flight without the effect may get worse by 5 % unless the plan says else";
}

TEST_F(PlanTest, ASeedThatIsLearntFromCannotBeJudged) {
  EXPECT_THAT(error("judged = [1, 2, 3]", "judged = [1, 201]"), HasSubstr("seed 201 is in seeds.learn and in seeds.judged"));
  EXPECT_THAT(error("held_out = [301]", "held_out = [201]"), HasSubstr("must not have been learnt from"));
}

TEST_F(PlanTest, OneJudgedSeedIsTooFewForAnInterval) { EXPECT_THAT(error("[1, 2, 3]", "[1]"), HasSubstr("no scatter to judge by")); }

TEST_F(PlanTest, AnExpectationIsNeverLeftOut) { EXPECT_THAT(error("expect = \"better\"\n", ""), HasSubstr("expect")); }

TEST_F(PlanTest, AMisspeltKeyIsAnErrorWithItsLine) { EXPECT_THAT(error("[seeds]", "undeclard = 1\n[seeds]"), HasSubstr("undeclard")); }

TEST_F(PlanTest, AFlightNameThatCouldLeaveItsFolderIsRefused) {
  EXPECT_THAT(error("name = \"fast\"", "name = \"../fast\""), HasSubstr("cannot name a flight"));
}

TEST(PlantWith, AppendsTheEffectsWithTheirParametersExactly) {
  EXPECT_EQ(
      plant_with("format = 1", {{"blockage_strut", {{"loss", 0.08}}, {}}, {"payload_mass", {{"mass_kg", 0.05}, {"x_m", 0.04}}, {}}}),
      "format = 1\n\n[[effect]]\nid = \"blockage_strut\"\nloss = 0.08\n\n[[effect]]\nid = \"payload_mass\"\nmass_kg = 0.05\nx_m = 0.04\n");
}

TEST(HilScenarioText, TellsNothingButWhatIsFlown) {
  const auto text = hil_scenario_text({"p.toml", "v.toml", "g.toml", {"t.toml"}}, host::Variant::pd_ff, {"fast"}, {7, 8});
  EXPECT_THAT(text, HasSubstr("name = \"flights\""));
  EXPECT_THAT(text, HasSubstr("seeds = [7, 8]"));
  EXPECT_THAT(text, HasSubstr("variants = [\"pd_ff\"]"));
}

}  // namespace
}  // namespace rotorloop::closed_loop
