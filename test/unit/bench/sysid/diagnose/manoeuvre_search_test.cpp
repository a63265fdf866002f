// Which flight separates two effects: pairs whose physics says the answer.
#include "bench/sysid/diagnose/manoeuvre/manoeuvre_search.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/diagnose/ranking/refit.hpp"
#include "test/unit/bench/sysid/diagnose/paper_flights.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace testing_flights;

// Three flights of 6 s that obey the paper's equations; thrust and drag of the rotors known from a stand.
const identify::Identification& fitted() {
  static const identify::Identification r = [] {
    std::vector<identify::FlightToFit> flights;
    for (const model_true::Manoeuvre m :
         {model_true::Manoeuvre::vertical, model_true::Manoeuvre::horizontal, model_true::Manoeuvre::rotation})
      flights.push_back(flight({}, {.manoeuvre = m, .duration_s = 6.0}, 21 + static_cast<std::uint64_t>(m)));
    return identify::identify(flights, vehicle(), options_holding({"k_1", "k_2", "c_d,h"}));
  }();
  return r;
}

Member member(const std::string& id, const std::vector<double>& sizes) {
  Member m{id, {}};
  const host::Term* t = host::find_term(id);
  for (std::size_t k = 0; k < sizes.size(); ++k)
    m.parameters.push_back({std::string(t->info.parameters[k].name), std::string(t->info.parameters[k].unit), sizes[k], 0.0});
  return m;
}

ManoeuvreAdvice advice(const Member& a, const Member& b, const SearchOptions& o = {.threads = 2}) {
  return rank_manoeuvres(fitted(), fitted(), std::vector<Member>{a, b}, o);
}
double worth(const ManoeuvreAdvice& a, const std::string& id) {
  for (const ManoeuvreValue& v : a.ranked) {
    if (v.id == id) return v.separation.front();
  }
  ADD_FAILURE() << id << " was not flown";
  return 0.0;
}

const Member kHeight = member("rotor_plane_height", {0.03}), kHub = member("hub_moment", {1e-6, 1e-6});
const Member kRotorDrag = member("rotor_drag", {1.5}), kLinearDrag = member("linear_drag", {0.06, 0.06, 0.0});

TEST(ManoeuvreSearch, MomentsThatGrowWithSpeedAreToldBySpeedThreeMetresPerSecondAreNotEnough) {
  const ManoeuvreAdvice a = advice(kHeight, kHub);
  EXPECT_TRUE(a.open.empty());
  EXPECT_GT(a.ranked.front().least, 10.0);
  EXPECT_GT(worth(a, "pass_y_fast"), 5.0 * worth(a, "pass_y_slow"));
  EXPECT_LT(worth(a, "hover"), 0.1);
  EXPECT_LT(worth(a, "vertical_fast"), 0.1);
}

// In proportion to thrust or to speed alone: equal speeds with unequal thrust.
TEST(ManoeuvreSearch, DragOfRotorsIsToldFromDragOfTheBodyByPulsesOfThrustAtSpeed) {
  const ManoeuvreAdvice a = advice(kRotorDrag, kLinearDrag);
  EXPECT_EQ(a.ranked.front().id, "pass_pulsed");
  EXPECT_GT(a.ranked.front().least, 3.0 * worth(a, "pass_x"));
  EXPECT_LT(worth(a, "thrust_pulses"), 0.2) << "without speed neither acts";
}

TEST(ManoeuvreSearch, GroundEffectIsToldFromThrustThatWasMisjudgedByHoveringLowAndNotHigh) {
  const ManoeuvreAdvice a = advice(member("ground_effect_rotor", {2.0}), member("thrust_scale", {0.97}));
  EXPECT_EQ(a.ranked.front().id, "hover_low");
  EXPECT_GT(a.ranked.front().least, 30.0);
  EXPECT_LT(worth(a, "hover"), 0.1);
}

TEST(ManoeuvreSearch, ForceFixedInTheBodyIsToldFromATiltedWorldByTurningTheHeadingInHover) {
  const ManoeuvreAdvice a = advice(member("body_force_bias", {0.13, 0.0, 0.0}), member("gravity_tilt", {0.02, 0.0}));
  EXPECT_GT(worth(a, "hover_turned"), 3.0 * worth(a, "hover"));
}

// Both keep their direction in the world, so that turning in hover separates them hardly more than standing still, where their sum is
// weighed; wind's force grows with thrust and with speed against it.
TEST(ManoeuvreSearch, WindIsDistinguishedFromATiltedWorldByRunsAndByThrustMoreThanByTurningInHover) {
  const ManoeuvreAdvice a = advice(member("wind_steady", {1.0, 0.0, 0.0}), member("gravity_tilt", {0.02, 0.0}));
  EXPECT_LT(worth(a, "hover_turned"), 1.25 * worth(a, "hover"));
  EXPECT_GT(worth(a, "thrust_pulses"), 1.5 * worth(a, "hover"));
  EXPECT_GT(worth(a, "pass_turning"), 2.0 * worth(a, "hover"));
}

TEST(ManoeuvreSearch, LiftOfTheBodyIsToldFromThrustThatWasMisjudgedBySpeed) {
  const ManoeuvreAdvice a = advice(member("body_lift", {2e-3}), member("thrust_scale", {0.97}));
  EXPECT_GT(worth(a, "pass_x_fast"), 2.5 * worth(a, "hover"));
  EXPECT_GT(worth(a, "pass_x_fast"), 2.5 * worth(a, "pass_x_slow"));
}

TEST(ManoeuvreSearch, EffectsWithTheSameLoadAreToldByNoManoeuvreAndTheDiagnosisSaysSo) {
  const Member alias = member("rotor_body_interference", {1.5});
  const ManoeuvreAdvice a = advice(kRotorDrag, alias);
  for (const ManoeuvreValue& v : a.ranked) EXPECT_LT(v.separation.front(), 1e-3) << v.id;
  EXPECT_EQ(a.open, std::vector<std::string>{"rotor_body_interference"});

  DiagnosisRun run;
  run.before = copy_of(fitted());
  run.after = copy_of(fitted());
  run.diagnosis.added.push_back(
      {.id = "rotor_drag", .parameters = kRotorDrag.parameters, .aliases = {{.id = alias.id, .parameters = alias.parameters}}});
  choose_manoeuvres(run, {}, 2);
  EXPECT_THAT(run.diagnosis.added.front().manoeuvre, ::testing::HasSubstr("no manoeuvre of"));
  EXPECT_THAT(run.diagnosis.added.front().manoeuvre, ::testing::HasSubstr("in proportion to T or to omega")) << "the catalogue's advice";
}

// Of three, the two that can be separated are, by one flight that serves for both.
TEST(ManoeuvreSearch, AnAliasThatNothingSeparatesDoesNotHideWhatSeparatesTheOthers) {
  const ManoeuvreAdvice a = rank_manoeuvres(
      fitted(), fitted(), std::vector<Member>{kRotorDrag, member("rotor_body_interference", {1.5}), kLinearDrag}, {.threads = 2});
  EXPECT_EQ(a.open, std::vector<std::string>{"rotor_body_interference"});
  ASSERT_EQ(a.ranked.front().separation.size(), 2u);
  EXPECT_EQ(a.ranked.front().id, "pass_pulsed");
  EXPECT_EQ(a.ranked.front().least, a.ranked.front().separation[1]);
}

TEST(ManoeuvreSearch, TwiceTheTimeSeparatesTwiceAsMuchAndCorrelatedResidualsLess) {
  const ManoeuvreAdvice ten = advice(kRotorDrag, kLinearDrag), twenty = advice(kRotorDrag, kLinearDrag, {.duration_s = 20.0, .threads = 2}),
                        correlated = advice(kRotorDrag, kLinearDrag, {.inflation = 4.0, .threads = 2});
  EXPECT_NEAR(worth(twenty, "pass_pulsed") / worth(ten, "pass_pulsed"), 2.0, 0.2);
  EXPECT_NEAR(worth(twenty, "figure_eight") / worth(ten, "figure_eight"), 2.0, 0.2);
  EXPECT_NEAR(worth(correlated, "pass_pulsed"), 0.25 * worth(ten, "pass_pulsed"), 1e-9);
}

}  // namespace
}  // namespace rotorloop::diagnose
