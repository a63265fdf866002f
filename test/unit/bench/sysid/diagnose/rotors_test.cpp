// Effects with a number for each rotor: what all four have in common is k_1's or c_q's, and no single number is determined as well as all
// of them together. Flights of eq. 1 to 8 whose log reads one rotor's speed too high.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/diagnose/ranking/refit.hpp"
#include "bench/sysid/diagnose/wald.hpp"
#include "bench/sysid/identify/gauge.hpp"
#include "test/unit/bench/sysid/diagnose/paper_flights.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr double kHigh = 0.03;  // the share by which the log reads rotor 1 too high

std::vector<identify::FlightToFit> flights_with_rotor_1_read_high() {
  std::vector<identify::FlightToFit> out;
  for (const model_true::Manoeuvre m : {model_true::Manoeuvre::vertical, model_true::Manoeuvre::rotation}) {
    out.push_back(testing_flights::flight({}, {.manoeuvre = m, .duration_s = 8.0}, 31 + static_cast<std::uint64_t>(m)));
    for (log::RotorValues& omega : out.back().record.rotor_omega_rad_s.value) omega[0] *= 1.0 + kHigh;
  }
  return out;
}
const identify::Identification& fitted() {
  static const identify::Identification r =
      identify::identify(flights_with_rotor_1_read_high(), testing_flights::vehicle(), testing_flights::options_holding({}));
  return r;
}

double excess_of_first(const std::vector<NamedValue>& numbers) {
  return numbers[0].value - (numbers[1].value + numbers[2].value + numbers[3].value) / 3.0;
}

struct Refitted {
  Candidate candidate;
  identify::Identification fit;
};
const Refitted& refitted() {
  static const Refitted r = [] {
    const Screening s = screen(fitted(), {}, {}, 0.5, 2);
    const Candidate& c =
        *std::find_if(s.candidates.begin(), s.candidates.end(), [](const Candidate& one) { return one.id == "rotor_speed_scale"; });
    Refit refit = begin_refit(fitted(), c, test_group(s.table, base_columns(s.table), c.columns).estimate, fitted().fit.noise, {});
    finish_refit(refit, {});
    return Refitted{c, std::move(refit.fit)};
  }();
  return r;
}

// Without the sum held the refit ended with "1 direction(s) of the parameters leave every residual unchanged".
TEST(RotorGroups, ARefitOfFourSpeedScalesFindsTheOneThatIsThreePerCentHighAndHoldsTheirSum) {
  std::vector<NamedValue> found;
  double sum = 0.0;
  for (const int p : parameters_of(refitted().candidate, refitted().fit.problem.start.terms)) {
    const estimate::Estimate* e = refitted().fit.fit.find(p);
    ASSERT_NE(e, nullptr);
    found.push_back({"", "", e->value, e->u});
    sum += e->value;
  }
  EXPECT_NEAR(excess_of_first(found), kHigh, 0.004);
  EXPECT_NEAR(sum, 0.0, 1e-4);
}
// A file that knows k_1 and k_2 leaves no gauge: held, the mean of the four numbers would be left over, 0.75 % of speed and 1.5 % of
// thrust.
TEST(RotorGroups, WithThrustKnownBeforehandOneRotorIsThreePerCentHighAndTheOthersAreNot) {
  identify::Identification known = copy_of(fitted());
  const model_true::Truth truth;
  const Eigen::Vector2d thrust(truth.k1_N_s2, truth.k2_N_s2_m), u = 1e-3 * thrust;
  known.problem.priors.push_back({{estimate::kK1, estimate::kK2}, thrust, Eigen::Matrix2d(u.cwiseAbs2().cwiseInverse().asDiagonal())});
  EXPECT_TRUE(identify::common_part_known("rotor_speed_scale", known.problem.priors));
  EXPECT_FALSE(identify::common_part_known("rotor_torque_scale", known.problem.priors));
  Refit refit = begin_refit(known, refitted().candidate, Eigen::Vector4d::Zero(), known.fit.noise, {});
  finish_refit(refit, {});
  const auto parameters = parameters_of(refitted().candidate, refit.fit.problem.start.terms);
  EXPECT_NEAR(refit.fit.fit.find(parameters[0])->value, kHigh, 0.004);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_NEAR(refit.fit.fit.find(parameters[i])->value, 0.0, 0.004);
}
TEST(RotorGroups, TakenOutAgainTheLogLikelihoodIsWhatItWas) {
  const identify::Identification without = refit_without(refitted().fit, refitted().candidate, {});
  EXPECT_NEAR(without.fit.log_likelihood, fitted().fit.log_likelihood, 0.1);
  EXPECT_TRUE(identify::rotor_groups(without.problem.start.terms, without.problem.free).empty());
  EXPECT_EQ(without.problem.priors.size(), fitted().problem.priors.size());
}

// Four numbers of which a common direction of the differences is hardly determined: each stands within two of its standard errors, all
// together at a chance of less than one in a million.
TEST(WaldTest, TellsFourNumbersTogetherOfWhichEachIsWithinTwoOfItsStandardErrors) {
  identify::Identification r;
  const host::Term& term = *host::find_term("weak_rotor");
  r.problem.start.terms.add(term);
  Candidate c{.id = "weak_rotor", .term = &term};
  const Eigen::Vector4d hardly_determined(0.5, 0.5, -0.5, -0.5), value(0.01, 0.01, -0.04, 0.02);
  const Eigen::Vector4d common = Eigen::Vector4d::Constant(0.5);
  const Eigen::Matrix4d differences = Eigen::Matrix4d::Identity() - common * common.transpose();
  r.fit.covariance =
      1e-6 * differences + 0.05 * 0.05 * 4.0 * hardly_determined * hardly_determined.transpose() + 1e-10 * common * common.transpose();
  r.fit.robust_covariance = r.fit.covariance;
  r.fit.blocks = 150;
  for (int i = 0; i < 4; ++i) {
    c.parameters.push_back({.name = "epsilon", .unit = "1", .min = -0.5, .max = 0.1});
    const double u = std::sqrt(r.fit.covariance(i, i));
    EXPECT_LT(std::fabs(value[i]), 2.0 * u);
    r.fit.estimates.push_back({.parameter = estimate::kCoreParameters + i, .value = value[i], .u = u, .u_robust = u});
  }
  const WaldTest all = wald_test(r, c, 3.3);
  EXPECT_EQ(all.degrees, 3);
  EXPECT_LT(all.p, 1e-6);
  EXPECT_LT(all.p, all.sure);
}
TEST(WaldTest, OfOneNumberIsTheSquareOfItsStandardErrorsByTheLargerCovariance) {
  identify::Identification r;
  const host::Term& term = *host::find_term("gyroscopic");
  r.problem.start.terms.add(term);
  Candidate c{.id = "gyroscopic", .term = &term};
  c.parameters.push_back({.name = "J_r_kg_m2", .unit = "kg m^2"});
  r.fit.covariance = Eigen::MatrixXd::Constant(1, 1, 1.0);
  r.fit.robust_covariance = Eigen::MatrixXd::Constant(1, 1, 4.0);
  r.fit.blocks = 150;
  for (const auto& [value, significant] : {std::pair{6.5, false}, std::pair{6.7, true}}) {
    r.fit.estimates = {{.parameter = estimate::kCoreParameters, .value = value, .u = 1.0, .u_robust = 2.0}};
    const WaldTest one = wald_test(r, c, 3.3);
    EXPECT_NEAR(one.statistic, value * value / 4.0, 1e-9);
    EXPECT_EQ(one.p <= one.sure, significant) << value;
  }
}

// The whole diagnosis: the four-rotor effect is named, alone or with its alias, and nothing else is.
TEST(RotorGroups, ALogThatReadsRotor1ThreePerCentHighIsDiagnosedAsThatOrItsAliasAndAsNothingElse) {
  DiagnoseOptions o;
  o.identify = testing_flights::options_holding({});
  o.identify.grid.slopes_by_middle = true;
  o.identify.fit.noise = {.rounds = 16, .tolerance = 0.05, .per_flight = true};
  o.identify.fit.max_iterations = 80;
  o.identify.fit.tolerance = 0.02;
  o.identify.fit.threads = 2;
  o.priors = false;
  const Diagnosis d = diagnose({.fitted = flights_with_rotor_1_read_high()}, testing_flights::vehicle(), o).diagnosis;
  ASSERT_EQ(d.added.size(), 1u);
  const AddedEffect& a = d.added.front();
  const auto is = [&](const std::string& id) {
    return a.id == id || std::any_of(a.aliases.begin(), a.aliases.end(), [&](const ClassMember& m) { return m.id == id; });
  };
  EXPECT_TRUE(is("rotor_speed_scale")) << a.id;
  EXPECT_LE(a.aliases.size(), 2u);
  EXPECT_TRUE(std::any_of(d.remarks.begin(), d.remarks.end(),
                          [](const std::string& r) { return r.find("differences between rotors") != std::string::npos; }));
}

}  // namespace
}  // namespace rotorloop::diagnose
