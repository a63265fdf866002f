// Whether a further effect is only what the law of the first leaves: hub moments (a moment that grows with speed) are in the model, and
// what else could be there is asked how much of it would be its own.
#include "bench/sysid/diagnose/law_remainder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "bench/sysid/diagnose/ranking/refit.hpp"
#include "test/unit/bench/sysid/diagnose/paper_flights.hpp"

namespace rotorloop::diagnose {
namespace {

struct Fitted {
  identify::Identification fit;
  Candidate found;
  Screening screening;
};

// Ten seconds out and back, hub moments of a size that does not matter here: the variations of a law are of one shape.
const Fitted& with_hub_moments() {
  static const Fitted f = [] {
    Fitted out;
    identify::IdentifyOptions o = testing_flights::options_holding({"k_1", "k_2", "c_d,h"});
    const host::Term& term = *host::find_term("hub_moment");
    o.terms.add(term);
    out.fit = identify::identify({testing_flights::flight({}, {.manoeuvre = model_true::Manoeuvre::horizontal, .duration_s = 10.0}, 7)},
                                 testing_flights::vehicle(), o);
    out.found = {.id = "hub_moment", .term = &term, .core = {}, .parameters = {}};
    for (const host::TermParameter& p : term.info.parameters) {
      out.found.parameters.push_back({std::string(p.name), std::string(p.unit), p.neutral, p.min, p.max, p.scale});
    }
    for (std::size_t k = 0; k < term.info.parameters.size(); ++k)
      out.fit.fit.values.front()[estimate::kCoreParameters + static_cast<int>(k)] = term.info.parameters[k].scale;
    out.screening = screen(out.fit, {}, {}, 0.5, 2);
    return out;
  }();
  return f;
}

double left(const std::string& id, double law_error = 0.3) {
  const Fitted& f = with_hub_moments();
  const auto c =
      std::find_if(f.screening.candidates.begin(), f.screening.candidates.end(), [&](const Candidate& one) { return one.id == id; });
  return share_beside_law(f.fit, f.found, f.screening, *c, law_error, 0.5, 2);
}

TEST(LawRemainder, AMomentThatGrowsWithTheSquareOfSpeedIsWhatALawLinearInSpeedLeaves) { EXPECT_LT(left("body_pitch_moment"), 0.1); }

TEST(LawRemainder, ALawThatIsExactLeavesNothing) { EXPECT_GT(left("body_pitch_moment", 1e-9), 0.99); }

TEST(LawRemainder, AForceAlongWhichNoMomentActsIsACauseOfItsOwn) { EXPECT_GT(left("body_lift"), 0.8); }

TEST(LawRemainder, ADelayHasNoLawThatCouldLeaveAnything) {
  const Fitted& f = with_hub_moments();
  const Candidate delay{.id = "rotor_speed_delay", .term = nullptr, .core = {estimate::kRotorDelay}, .parameters = {}};
  EXPECT_TRUE(law_variations(f.fit, delay, kEveryAxis).empty());
}

// Nine variations of each load: two moments about their own axes, the larger one about the other two, and no force from a moment.
TEST(LawRemainder, ALawOfTwoMomentsLeavesMomentsOnAllThreeAxesAndNoForce) {
  const auto columns = law_variations(with_hub_moments().fit, with_hub_moments().found, kEveryAxis);
  ASSERT_EQ(columns.size(), 1u);
  EXPECT_EQ(columns.front().count, 4 * 9);
  EXPECT_TRUE(law_variations(with_hub_moments().fit, with_hub_moments().found, {true, true, true, false, false, false}).empty());
}

// A constant force along the body's z: it may be a little askew (force x, y) and miss the centre of mass (torque x, y), and turns nothing
// about z.
TEST(LawRemainder, AForceAlongZLeavesForcesOnAllAxesAndMomentsAboutXAndYButNoneAboutItsOwnLine) {
  const host::Term& term = *host::find_term("body_force_bias");
  identify::Identification fit = copy_of(with_hub_moments().fit);
  Candidate found{.id = "body_force_bias", .term = &term, .core = {}, .parameters = {}};
  fit.problem.start.terms.add(term);
  fit.fit.values.front().terms.add(term);
  for (const host::TermParameter& p : term.info.parameters) {
    found.parameters.push_back({std::string(p.name), std::string(p.unit), p.neutral, p.min, p.max, p.scale});
    fit.problem.start.values.push_back(0.0);
    fit.fit.values.front().values.push_back(found.parameters.size() == 3 ? 0.1 : 0.0);
  }
  ASSERT_EQ(law_variations(fit, found, kEveryAxis).size(), 1u);
  EXPECT_EQ(law_variations(fit, found, kEveryAxis).front().count, 5 * 9);
  EXPECT_TRUE(law_variations(fit, found, {false, false, false, false, false, true}).empty());
}

// A moment of the rotors' torque on yaw, where the hub moments of this flight lie in roll and pitch.
TEST(LawRemainder, ATorqueThatGrowsWithClimbIsNoRemainderOfHubMoments) { EXPECT_GT(left("inflow_torque"), 0.5); }

}  // namespace
}  // namespace rotorloop::diagnose
