#include "bench/hil/closed_loop/truth.hpp"

#include <gtest/gtest.h>

#include "bench/hil/closed_loop/findings.hpp"
#include "bench/hil/closed_loop/plan.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::closed_loop {
namespace {

LoopPlan hiding(std::vector<InjectedEffect> hidden) {
  LoopPlan p;
  p.injected = std::move(hidden);
  return p;
}
FoundEffect found(const std::string& id, std::vector<std::string> aliases = {}, std::vector<FoundValue> parameters = {}) {
  FoundEffect f;
  f.id = id;
  for (auto& t : aliases) f.aliases.push_back({std::move(t), {}});
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
  EXPECT_EQ(c.hidden[0].name, NameResult::right);
  EXPECT_TRUE(c.right());
  ASSERT_EQ(c.values.size(), 1u);
  EXPECT_NEAR(c.values[0].errors_in_u(), -1.0, 1e-12);
}

TEST(CompareEffects, AmongTheMembersOfAClassIsAClassNotANameAndNotWrong) {
  const auto c = compare_effects(hiding({{"blockage_strut", {}, {}}}), naming({found("thrust_scale", {"blockage_strut", "air_density"})}));
  EXPECT_EQ(c.hidden[0].name, NameResult::in_class);
  EXPECT_TRUE(c.wrong.empty());
  EXPECT_TRUE(c.right());
}

TEST(CompareEffects, TheSizeOfAMemberOfAClassIsComparedToo) {
  auto answer = found("thrust_scale", {"blockage_strut"});
  answer.aliases[0].parameters = {{"loss", "1", 0.083, 0.002}};
  const auto c = compare_effects(hiding({{"blockage_strut", {{"loss", 0.08}}, {}}}), naming({answer}));
  ASSERT_EQ(c.values.size(), 1u);
  EXPECT_NEAR(c.values[0].errors_in_u(), 1.5, 1e-9);
}

TEST(CompareEffects, AnotherNameIsWrongAndTheHiddenOneMissed) {
  const auto c = compare_effects(hiding({{"rotor_wake_interference", {}, {}}}), naming({found("blade_flapping")}));
  EXPECT_EQ(c.hidden[0].name, NameResult::missed);
  EXPECT_EQ(c.wrong, (std::vector<std::string>{"blade_flapping"}));
  EXPECT_FALSE(c.right());
}

TEST(CompareEffects, NothingFoundWhereNothingWasHiddenIsRightAndSomethingFoundIsWrong) {
  EXPECT_TRUE(compare_effects(hiding({}), naming({})).right());
  EXPECT_FALSE(compare_effects(hiding({}), naming({found("tether")})).right());
}

TEST(CompareEffects, WhatAHiddenEffectShowsAsCountsForIt) {
  const auto c = compare_effects(hiding({{"payload_mass", {}, {"com_offset"}}}), naming({found("com_offset")}));
  EXPECT_EQ(c.hidden[0].name, NameResult::in_class) << "not its own name, so not right, but not wrong either";
  EXPECT_TRUE(c.wrong.empty());
}

TEST(CompareEffects, WhatThePlantHasBesidesIsNeverWrong) {
  auto plan = hiding({});
  plan.also_true = {"thrust_speed_exponent"};
  EXPECT_TRUE(compare_effects(plan, naming({found("thrust_speed_exponent")})).right());
}

TEST(CompareEffects, ARightNameWithASize24PercentAnd7StandardErrorsOffIsAWrongSize) {
  const auto c = compare_effects(hiding({{"rotor_wake_interference", {{"kappa", 0.35}}, {}}}),
                                 naming({found("rotor_wake_interference", {}, {{"kappa", "1", 0.433, 0.011}})}));
  EXPECT_TRUE(c.names_right());
  EXPECT_EQ(c.hidden[0].name, NameResult::right);
  EXPECT_EQ(c.hidden[0].size, Size::wrong);
  EXPECT_FALSE(c.sizes_right());
  EXPECT_FALSE(c.right());
}

TEST(CompareEffects, ASizeIsRightWithin3StandardErrorsOrWithin1PercentOfTheTruth) {
  const auto size = [](double found, double u) { return TruthValue{"loss of blockage_strut", "1", 0.08, found, u}.right(); };
  EXPECT_TRUE(size(0.0859, 0.002));
  EXPECT_FALSE(size(0.0861, 0.002));
  EXPECT_FALSE(size(0.0739, 0.002));
  EXPECT_TRUE(size(0.08079, 1e-6)) << "0.99 % off, however small the stated uncertainty is";
  EXPECT_FALSE(size(0.08081, 1e-6));
  EXPECT_TRUE(size(0.08079, 0.0)) << "a value without an uncertainty";
}

TEST(CompareEffects, AnInertia3Point4PercentAnd7StandardErrorsLowIsWrongThoughTheNamesAreRight) {
  TruthComparison c = compare_effects(hiding({{"payload_mass", {{"mass_kg", 0.06}}, {}}}),
                                      naming({found("payload_mass", {"rotor_speed_scale"}, {{"mass_kg", "kg", 0.0588, 0.0013}})}));
  EXPECT_EQ(c.hidden[0].size, Size::right);
  EXPECT_TRUE(c.right());
  c.values.push_back({"I_zz", "kg m^2", 5.0e-3, 4.83e-3, 0.024e-3});
  EXPECT_TRUE(c.names_right());
  EXPECT_FALSE(c.right());
}

TEST(CompareEffects, APlaceOfTheCentreOfMassIsRightWithinATenthOfAMillimetreThoughItsTruthIsZero) {
  EXPECT_TRUE((TruthValue{"centre of mass y", "m", 0.0, 0.99e-4, 1e-6}.right()));
  EXPECT_FALSE((TruthValue{"centre of mass y", "m", 0.0, 1.01e-4, 1e-6}.right()));
}

TEST(CompareEffects, APayloadMayBeNamedByItselfAndTheTwoThatTheCatalogueCannotTellFromIt) {
  EXPECT_EQ(names_of({"payload_mass", {}, {}}), (std::vector<std::string>{"payload_mass", "thrust_scale", "air_density"}));
  const auto c = compare_effects(hiding({{"payload_mass", {}, {}}}), naming({found("blockage_strut")}));
  EXPECT_EQ(c.hidden[0].name, NameResult::missed);
  EXPECT_EQ(c.wrong, (std::vector<std::string>{"blockage_strut"}));
}

TEST(CompareEffects, InTheShippedLoopAShiftedCentreOfMassIsNoNameForThePayloadThatShiftsItNorWrong) {
  const auto plan = read_loop_plan(std::string(ROTORLOOP_SOURCE_DIR) + "/scenarios/close/payload.toml");
  const auto c = compare_effects(plan, naming({found("com_offset")}));
  ASSERT_EQ(c.hidden.size(), 1u);
  EXPECT_EQ(c.hidden[0].name, NameResult::missed);
  EXPECT_TRUE(c.wrong.empty());
  EXPECT_FALSE(c.names_right());
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
  c.hidden = {{"tether", NameResult::in_class, "slung_load", Size::wrong}};
  c.wrong = {"wind_steady"};
  c.values = {{"I_xx", "kg m^2", 2.4e-3, 2.3e-3, 1e-4}};
  const auto back = read_truth(folder.write("truth.json", truth_json(c)));
  EXPECT_EQ(back.hidden.at(0).name, NameResult::in_class);
  EXPECT_EQ(back.hidden.at(0).answer, "slung_load");
  EXPECT_EQ(back.wrong, c.wrong);
  EXPECT_EQ(back.hidden.at(0).size, Size::wrong);
  EXPECT_EQ(back.values.at(0).truth, 2.4e-3);
  EXPECT_EQ(truth_json(back), truth_json(c));
}

}  // namespace
}  // namespace rotorloop::closed_loop
