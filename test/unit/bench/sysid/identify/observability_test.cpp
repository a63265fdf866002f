// What flights can determine and what not: on flights that obey the model, whose manoeuvres excite known parameters only.
#include "bench/sysid/identify/observability.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "host/vehicle/effect_catalogue.hpp"
#include "test/support/model_true_flight.hpp"
#include "test/support/model_true_vehicle.hpp"

namespace rotorloop::identify {
namespace {

using model_true::Manoeuvre;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

estimate::GridFlight flown(model_true::FlightSettings s) {
  s.duration_s = 5.0;
  return estimate::make_grid(model_true::fly({}, s).record, {.rate_Hz = 100.0});
}
estimate::GridFlight hover() {
  estimate::GridFlight g = flown({.path = [](double) { return model_true::Reference{}; }, .seed = 3});
  g.name = "hover";
  return g;
}

std::vector<estimate::FreeParameter> thrust_and_drag() {
  std::vector<estimate::FreeParameter> out;
  for (const int p : {estimate::kK1, estimate::kK2, estimate::kCdh, estimate::kCdxy, estimate::kCdz, estimate::kComX, estimate::kComY})
    out.push_back({.parameter = p});
  return out;
}

struct Fitted {
  estimate::FitProblem problem;
  estimate::Fit fit;
  Observability observability;
};
Fitted fitted(std::vector<const estimate::GridFlight*> flights, const std::vector<estimate::FreeParameter>& free = thrust_and_drag(),
              const host::TermList& terms = {}) {
  Fitted out;
  out.problem.start = estimate::model_values(model_true::vehicle_of({}), terms);
  out.problem.free = free;
  out.problem.flights = std::move(flights);
  out.problem.noise.force_m_s2_rtHz.setConstant(0.03);
  out.problem.noise.angular_rad_s2_rtHz.setConstant(0.3);
  out.problem.noise.position_m.setConstant(2e-3);
  out.problem.noise.attitude_rad.setConstant(2e-3);
  out.fit = fit(out.problem);
  out.observability = observability_of(out.problem, out.fit);
  return out;
}

const Advice* advice_for(const Observability& o, const std::string& parameter) {
  for (const Advice& a : o.advice) {
    if (a.parameter == parameter) return &a;
  }
  return nullptr;
}

TEST(Observability, AHoverCannotTellDragNorTheTwoThrustCoefficientsFromEachOther) {
  const estimate::GridFlight g = hover();
  const Observability o = fitted({&g}).observability;
  ASSERT_EQ(o.flights.size(), 1u);
  EXPECT_EQ(o.flights[0].flight, "hover");
  EXPECT_NEAR(o.flights[0].seconds, 5.0, 0.1);
  for (const char* drag : {"c_d,h", "c_d,xy", "c_d,z"}) EXPECT_THAT(o.flights[0].undetermined, Contains(drag));
  EXPECT_THAT(o.flights[0].undetermined, Contains("k_2"));
  EXPECT_THAT(o.flights[0].undetermined, Not(Contains("Δx"))) << "a hover determines the centre of mass";
  // The weakest direction: more k_1 and as much less k_2 carry the same weight.
  ASSERT_FALSE(o.weakest.empty());
  ASSERT_GE(o.weakest[0].parts.size(), 2u);
  EXPECT_THAT((std::vector{o.weakest[0].parts[0].first, o.weakest[0].parts[1].first}), testing::UnorderedElementsAre("k_1", "k_2"));
  ASSERT_FALSE(o.correlated.empty());
  EXPECT_EQ(o.correlated[0].first + " " + o.correlated[0].second, "k_1 k_2");
  EXPECT_LT(o.correlated[0].correlation, -0.999);
}

TEST(Observability, EachFlightSaysWhatItTellsByItself) {
  const estimate::GridFlight still = hover(), up = flown({.manoeuvre = Manoeuvre::vertical}),
                             fast = flown({.manoeuvre = Manoeuvre::horizontal});
  const Observability o = fitted({&still, &up, &fast}).observability;
  ASSERT_EQ(o.flights.size(), 3u);
  const auto &of_hover = o.flights[0].undetermined, &of_climb = o.flights[1].undetermined, &of_dash = o.flights[2].undetermined;
  EXPECT_THAT(of_hover, Contains("k_2"));
  EXPECT_THAT(of_climb, Not(Contains("k_2")));
  EXPECT_THAT(of_hover, Contains("c_d,h"));
  EXPECT_THAT(of_climb, Contains("c_d,h"));
  EXPECT_THAT(of_dash, Not(Contains("c_d,h")));
  // Information on c_d,h, the third of the free parameters, goes with the square of the speed.
  EXPECT_GT(o.flights[2].information[2], 100.0 * o.flights[0].information[2]);
}

TEST(Observability, ListsEveryStrongCorrelationOfTheCovarianceStrongestFirstAndNoOther) {
  const estimate::GridFlight up = flown({.manoeuvre = Manoeuvre::vertical}), fast = flown({.manoeuvre = Manoeuvre::horizontal});
  const Fitted f = fitted({&up, &fast});
  std::size_t strong = 0;
  for (Eigen::Index a = 0; a < f.fit.covariance.rows(); ++a) {
    for (Eigen::Index b = 0; b < a; ++b)
      strong += std::fabs(f.fit.covariance(a, b)) > 0.9 * std::sqrt(f.fit.covariance(a, a) * f.fit.covariance(b, b));
  }
  EXPECT_GT(strong, 0u);
  EXPECT_LT(strong, 21u) << "not every pair of seven is strong";
  ASSERT_EQ(f.observability.correlated.size(), strong);
  double before = 1.0;
  for (const CorrelatedPair& pair : f.observability.correlated) {
    EXPECT_GT(std::fabs(pair.correlation), 0.9);
    EXPECT_LE(std::fabs(pair.correlation), before);
    before = std::fabs(pair.correlation);
  }
}

TEST(Observability, FlightsInMoreDirectionsAreBetterConditionedAndNeedLessAdvice) {
  const estimate::GridFlight still = hover(), up = flown({.manoeuvre = Manoeuvre::vertical}),
                             fast = flown({.manoeuvre = Manoeuvre::horizontal});
  const Observability poor = fitted({&still}).observability, rich = fitted({&still, &up, &fast}).observability;
  EXPECT_LT(rich.condition, 0.1 * poor.condition);
  EXPECT_TRUE(advice_for(poor, "c_d,h"));
  EXPECT_FALSE(advice_for(rich, "c_d,h"));
}

TEST(Observability, AdviceSaysHowPoorlyAParameterIsKnownAndNamesItsManoeuvre) {
  const estimate::GridFlight g = hover();
  const Observability o = fitted({&g}).observability;
  const Advice* drag = advice_for(o, "c_d,h");
  ASSERT_TRUE(drag);
  EXPECT_THAT(drag->why, HasSubstr("% of its size only"));
  EXPECT_THAT(drag->manoeuvre, HasSubstr("horizontal flight at several speeds"));
  const Advice* thrust = advice_for(o, "k_2");
  ASSERT_TRUE(thrust);
  EXPECT_THAT(thrust->manoeuvre, HasSubstr("fast climbs and descents"));
}

TEST(Observability, AParameterThatOnlyItsPriorHoldsIsNamedAsSuchThoughItIsKnownWell) {
  const estimate::GridFlight g = hover();
  auto free = thrust_and_drag();
  for (estimate::FreeParameter& f : free) {
    if (f.parameter == estimate::kCdh) f.prior_u = 1e-4;
  }
  const Observability o = fitted({&g}, free).observability;
  const Advice* drag = advice_for(o, "c_d,h");
  ASSERT_TRUE(drag);
  EXPECT_EQ(drag->why, "its prior holds more than half of what is known");
}

TEST(Observability, AdviceForATermIsTheManoeuvreOfTheCatalogue) {
  host::TermList terms;
  ASSERT_TRUE(terms.add(*host::find_term("rotor_local_inflow")));
  const estimate::GridFlight g = hover();
  const Observability o = fitted({&g}, {{.parameter = estimate::kK1}, {.parameter = estimate::kCoreParameters}}, terms).observability;
  const Advice* share = advice_for(o, "rotor_local_inflow.share");
  ASSERT_TRUE(share);
  EXPECT_THAT(share->manoeuvre, HasSubstr("roll and pitch chirps"));
}

TEST(Observability, EveryParameterAndEveryTermHasAManoeuvre) {
  for (int p = 0; p < estimate::kCoreParameters; ++p) EXPECT_NE(manoeuvre_for(p, {}), "") << estimate::parameter_info(p, {}).name;
  for (const host::Term& term : host::all_terms()) {
    host::TermList one;
    ASSERT_TRUE(one.add(term));
    const std::string& manoeuvre = host::effect(term.info.id).manoeuvre;
    EXPECT_NE(manoeuvre, "") << term.info.id;
    EXPECT_EQ(manoeuvre_for(estimate::kCoreParameters, one), manoeuvre) << term.info.id;
  }
}

TEST(Observability, AdviceForATermOfTheUsersOwnNamesTheTerm) {
  host::Term own = *host::find_term("rotor_local_inflow");
  own.info.id = "my_spring";
  host::TermList terms;
  ASSERT_TRUE(terms.add(own));
  EXPECT_THAT(manoeuvre_for(estimate::kCoreParameters, terms), HasSubstr("the load of my_spring"));
}

}  // namespace
}  // namespace rotorloop::identify
