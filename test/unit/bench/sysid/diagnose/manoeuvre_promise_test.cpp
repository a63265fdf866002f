// What the search for manoeuvres promises, kept in flights that share nothing with it.
#include <gtest/gtest.h>

#include <stdexcept>

#include "bench/sysid/diagnose/manoeuvre/manoeuvre_search.hpp"
#include "test/unit/bench/sysid/diagnose/paper_flights.hpp"

namespace rotorloop::diagnose {
namespace {

using namespace testing_flights;

// A manoeuvre's path for the other simulator's pilot.
model_true::FlightSettings settings_of(const std::string& id, double duration_s) {
  for (const Manoeuvre& m : manoeuvres()) {
    if (id != m.id) continue;
    return {.path =
                [&m](double t) {
                  const PathPoint p = path_point(m, t, 1.0, 1.0);
                  return model_true::Reference{.p_W_m = p.p_m, .yaw_rad = p.yaw_rad};
                },
            .duration_s = duration_s};
  }
  throw std::logic_error("no manoeuvre of that name");
}

// Centre of mass 1.5 mm from its nominal place, against a constant torque of the same size in hover: in flights near hover much alike.
// Flown by the second writing of equations 1 to 8, whose thrust, integration, pilot, motors and noise are not those of the search.
TEST(ManoeuvreSearch, TheChosenManoeuvreKeepsItsPromiseInFlightsOfAnotherSimulatorAndTheWorstSeparatesNothing) {
  model_true::Truth truth;
  truth.com_offset_m.x() += 1.5e-3;
  truth.r_BS_m.x() -= 1.5e-3;  // the sensor stays where it is
  const identify::FlightToFit past = flight(truth, {.manoeuvre = model_true::Manoeuvre::rotation, .duration_s = 6.0}, 5);
  const auto fit_with = [&](const std::string& id, const std::vector<identify::FlightToFit>& flights) {
    identify::IdentifyOptions o = options_holding({"k_1", "k_2", "c_d,h", "Δx", "Δy"});
    o.terms.add(*host::find_term(id));
    return identify::identify(flights, vehicle(), o);
  };
  const auto found = [](const identify::Identification& r) {
    const host::Term& t = r.problem.start.terms.term(0);
    Member m{std::string(t.info.id), {}};
    for (std::size_t k = 0; k < t.info.parameters.size(); ++k)
      m.parameters.push_back(
          {std::string(t.info.parameters[k].name), "", r.fit.find(estimate::kCoreParameters + static_cast<int>(k))->value, 0.0});
    return m;
  };
  const identify::Identification shifted = fit_with("com_offset", {past}), pushed = fit_with("body_torque_bias", {past});
  EXPECT_NEAR(found(shifted).parameters[0].value, 1.5e-3, 0.3e-3);

  constexpr double kFlown_s = 20.0;
  const ManoeuvreAdvice a =
      rank_manoeuvres(shifted, shifted, std::vector<Member>{found(shifted), found(pushed)}, {.duration_s = kFlown_s, .threads = 2});
  const ManoeuvreValue &best = a.ranked.front(), &worst = a.ranked.back();
  const double before = shifted.fit.log_likelihood - pushed.fit.log_likelihood;
  const auto separated = [&](const ManoeuvreValue& v) {
    const std::vector<identify::FlightToFit> flights{past, flight(truth, settings_of(v.id, kFlown_s), 6)};
    return fit_with("com_offset", flights).fit.log_likelihood - fit_with("body_torque_bias", flights).fit.log_likelihood - before;
  };
  const double by_best = separated(best), by_worst = separated(worst);
  EXPECT_EQ(best.id, "thrust_pulses");
  EXPECT_GT(best.least, 100.0);
  EXPECT_NEAR(by_best, best.least, 0.4 * best.least);
  EXPECT_LT(worst.least, 1.0);
  EXPECT_LT(by_worst, 6.0) << "chance alone gives a few";
}

}  // namespace
}  // namespace rotorloop::diagnose
