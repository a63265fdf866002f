#include "bench/close/truth.hpp"

#include <gtest/gtest.h>

#include "bench/close/findings.hpp"
#include "bench/close/plan.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

LoopPlan hiding(std::vector<Undeclared> hidden) {
  LoopPlan p;
  p.undeclared = std::move(hidden);
  return p;
}
FoundEffect found(const std::string& id, std::vector<std::string> twins = {}, std::vector<FoundValue> parameters = {}) {
  FoundEffect f;
  f.id = id;
  for (auto& t : twins) f.twins.push_back({std::move(t), {}});
  f.parameters = std::move(parameters);
  return f;
}
Findings naming(std::vector<FoundEffect> added) {
  Findings f;
  f.verdict = "named";
  f.added = std::move(added);
  return f;
}

TEST(CompareEffects, NamedByItsIdAloneIsRightAndItsSizeIsComparedInUnitsOfU) {
  const auto c = compare_effects(hiding({{"blockage_strut", {{"loss", 0.08}}, {}}}),
                                 naming({found("blockage_strut", {}, {{"loss", "1", 0.075, 0.005}})}));
  ASSERT_EQ(c.hidden.size(), 1u);
  EXPECT_EQ(c.hidden[0].told, Told::right);
  EXPECT_TRUE(c.right());
  ASSERT_EQ(c.values.size(), 1u);
  EXPECT_NEAR(c.values[0].errors_in_u(), -1.0, 1e-12);
}

TEST(CompareEffects, AmongTheMembersOfAClassIsAClassNotANameAndNotWrong) {
  const auto c = compare_effects(hiding({{"blockage_strut", {}, {}}}), naming({found("thrust_scale", {"blockage_strut", "air_density"})}));
  EXPECT_EQ(c.hidden[0].told, Told::in_class);
  EXPECT_TRUE(c.wrong.empty());
  EXPECT_TRUE(c.right());
}

TEST(CompareEffects, TheSizeOfAMemberOfAClassIsComparedToo) {
  auto answer = found("thrust_scale", {"blockage_strut"});
  answer.twins[0].parameters = {{"loss", "1", 0.083, 0.002}};
  const auto c = compare_effects(hiding({{"blockage_strut", {{"loss", 0.08}}, {}}}), naming({answer}));
  ASSERT_EQ(c.values.size(), 1u);
  EXPECT_NEAR(c.values[0].errors_in_u(), 1.5, 1e-9);
}

TEST(CompareEffects, AnotherNameIsWrongAndTheHiddenOneMissed) {
  const auto c = compare_effects(hiding({{"rotor_wake_interference", {}, {}}}), naming({found("blade_flapping")}));
  EXPECT_EQ(c.hidden[0].told, Told::missed);
  EXPECT_EQ(c.wrong, (std::vector<std::string>{"blade_flapping"}));
  EXPECT_FALSE(c.right());
}

TEST(CompareEffects, NothingFoundWhereNothingWasHiddenIsRightAndSomethingFoundIsWrong) {
  EXPECT_TRUE(compare_effects(hiding({}), naming({})).right());
  EXPECT_FALSE(compare_effects(hiding({}), naming({found("tether")})).right());
}

TEST(CompareEffects, WhatAHiddenEffectShowsAsCountsForIt) {
  const auto c = compare_effects(hiding({{"payload_mass", {}, {"com_offset"}}}), naming({found("com_offset")}));
  EXPECT_EQ(c.hidden[0].told, Told::in_class) << "not its own name, so not right, but not wrong either";
  EXPECT_TRUE(c.wrong.empty());
}

TEST(CompareEffects, WhatThePlantHasBesidesIsNeverWrong) {
  auto plan = hiding({});
  plan.also_true = {"thrust_speed_exponent"};
  EXPECT_TRUE(compare_effects(plan, naming({found("thrust_speed_exponent")})).right());
}

TEST(FlyingBody, APayloadOf100GramsAheadAndBelowMovesTheCentreOfMassAndAddsInertiaAboutTheNewOne) {
  host::VehicleFile v;
  v.mass_kg = {0.7, 0.003, host::Origin::flight};
  v.com_offset_m[0] = {0.002, 0.0, host::Origin::flight};
  v.inertia_kg_m2[0].value = 2e-3;
  v.inertia_kg_m2[1].value = 3e-3;
  v.inertia_kg_m2[2].value = 5e-3;
  const double x_m = 0.06, z_m = -0.03, payload_kg = 0.1;  // from the centre of mass without it
  v.effects.push_back({"payload_mass",
                       {{"mass_kg", {payload_kg, 0.004, host::Origin::flight}},
                        {"moment_x_kg_m", {payload_kg * x_m, 8e-4, host::Origin::flight}},
                        {"moment_y_kg_m", {0.0, 0.0, host::Origin::flight}},
                        {"moment_z_kg_m", {payload_kg * z_m, 0.0, host::Origin::flight}}},
                       {}});
  const FlyingBody b = flying_body(v);
  EXPECT_NEAR(b.mass_kg.value, 0.8, 1e-12);
  EXPECT_NEAR(b.mass_kg.u, 0.005, 1e-12);
  const double forward = payload_kg * x_m / 0.8, up = payload_kg * z_m / 0.8;
  EXPECT_NEAR(b.com_m[0].value, 0.002 + forward, 1e-12);
  EXPECT_NEAR(b.com_m[0].u, 1e-3, 1e-12);
  // Steiner's theorem for each of the two bodies.
  const double ahead = x_m - forward, below = z_m - up;
  EXPECT_NEAR(b.inertia_kg_m2[0].value, 2e-3 + 0.7 * up * up + payload_kg * below * below, 1e-12);
  EXPECT_NEAR(b.inertia_kg_m2[1].value, 3e-3 + 0.7 * (up * up + forward * forward) + payload_kg * (below * below + ahead * ahead), 1e-12);
  EXPECT_NEAR(b.inertia_kg_m2[2].value, 5e-3 + 0.7 * forward * forward + payload_kg * ahead * ahead, 1e-12);
}

TEST(TruthJson, ReadsBack) {
  test::TempFolder folder;
  TruthComparison c;
  c.hidden = {{"tether", Told::in_class, "slung_load"}};
  c.wrong = {"wind_steady"};
  c.values = {{"I_xx", "kg m^2", 2.4e-3, 2.3e-3, 1e-4}};
  const auto back = read_truth(folder.write("truth.json", truth_json(c)));
  EXPECT_EQ(back.hidden.at(0).told, Told::in_class);
  EXPECT_EQ(back.hidden.at(0).answer, "slung_load");
  EXPECT_EQ(back.wrong, c.wrong);
  EXPECT_EQ(back.values.at(0).truth, 2.4e-3);
}

}  // namespace
}  // namespace rotorloop::closed_loop
