// The value that diagnose() returns holds all that the command decides and shows: result.json of a simulated flight says the same, field by
// field. Two flights of eq. 1 to 8 whose log reads rotor 1 three per cent high, a third held out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench/sysid/diagnose/diagnose.hpp"
#include "bench/sysid/diagnose/ratios.hpp"
#include "bench/sysid/diagnose/report/diagnosis_outcome.hpp"
#include "bench/sysid/diagnose/report/diagnosis_report.hpp"
#include "bench/sysid/diagnose/report/diagnosis_text.hpp"
#include "bench/sysid/diagnose/report/rejection_text.hpp"
#include "test/unit/bench/sysid/diagnose/paper_flights.hpp"

namespace rotorloop::diagnose {
namespace {

using nlohmann::json;

identify::FlightToFit read_high(model_true::Manoeuvre m, std::uint64_t seed) {
  identify::FlightToFit out = testing_flights::flight({}, {.manoeuvre = m, .duration_s = 8.0}, seed);
  for (log::RotorValues& omega : out.record.rotor_omega_rad_s.value) omega[0] *= 1.03;
  return out;
}

DiagnoseOptions quick() {
  DiagnoseOptions o;
  o.identify = testing_flights::options_holding({});
  o.identify.grid.slopes_by_middle = true;
  o.identify.fit.noise = {.rounds = 16, .tolerance = 0.05, .per_flight = true};
  o.identify.fit.max_iterations = 80;
  o.identify.fit.tolerance = 0.02;
  o.identify.fit.threads = 2;
  o.priors = false;
  o.placebos = 20;
  return o;
}

const DiagnosisRun& diagnosed() {
  static const DiagnosisRun run = [] {
    const log::LogFinding lost{"gyro", "stands still", 1.0, 2.0, log::FindingAction::exclude, true};
    const log::LogFinding ground{"all", "on the ground", 0.0, 0.5, log::FindingAction::exclude, false};
    const log::LogFinding note{"pose", "of no consequence"};
    return diagnose({.fitted = {read_high(model_true::Manoeuvre::vertical, 31), read_high(model_true::Manoeuvre::rotation, 33)},
                     .held_out = {read_high(model_true::Manoeuvre::horizontal, 32)},
                     .findings = {{lost, note}, {ground}}},
                    testing_flights::vehicle(), quick());
  }();
  return run;
}
const json& written() {
  static const json j = json::parse(diagnosis_json(diagnosed(), {"1.2.3", "abc", "2026-01-01T00:00:00Z", 4.5, {{"a.csv", "00ff"}}}));
  return j;
}

void expect_values(const json& j, const std::vector<NamedValue>& values) {
  ASSERT_EQ(j.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(j[i].at("name"), values[i].name);
    EXPECT_EQ(j[i].at("unit"), values[i].unit);
    EXPECT_EQ(j[i].at("value").get<double>(), values[i].value);
    EXPECT_EQ(j[i].at("u").get<double>(), values[i].u);
  }
}
void expect_evidence(const json& j, const CandidateEvidence& e) {
  EXPECT_EQ(j.at("id"), e.id);
  expect_values(j.at("one_step"), e.one_step);
  EXPECT_EQ(j.at("degrees"), e.degrees);
  EXPECT_EQ(j.at("inside_bounds"), e.inside_bounds);
  EXPECT_EQ(j.at("ruled_out_by"), words(e.ruled_out_by));
  EXPECT_EQ(j.at("reason").is_null(), e.ruled_out_by.none());
  if (!e.ruled_out_by.none()) {
    EXPECT_EQ(j.at("reason").at("id"), name(e.ruled_out_by.id));
    EXPECT_EQ(j.at("reason").at("figures").size(), e.ruled_out_by.figures.size());
  }
  const std::pair<const char*, double> numbers[] = {{"chi2", e.chi2},
                                                    {"wald", e.wald},
                                                    {"p", e.p},
                                                    {"p_holm", e.p_holm},
                                                    {"gain", e.gain},
                                                    {"bic", e.bic},
                                                    {"delta_log_likelihood", e.delta_log_likelihood},
                                                    {"gain_relative", e.gain_relative},
                                                    {"scatter", e.scatter},
                                                    {"variation", e.variation},
                                                    {"typical", e.typical},
                                                    {"detectable", e.detectable},
                                                    {"cross_validated", e.cross_validated}};
  for (const auto& [key, value] : numbers) EXPECT_EQ(j.at(key).get<double>(), value) << e.id << " " << key;
}
void expect_faults(const json& j, const std::vector<LogFault>& all) {
  ASSERT_EQ(j.size(), all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(j[i].at("flight"), all[i].flight);
    EXPECT_EQ(j[i].at("stream"), all[i].stream);
    EXPECT_EQ(j[i].at("what"), all[i].what);
    EXPECT_EQ(j[i].at("from_s").get<double>(), all[i].from_s);
    EXPECT_EQ(j[i].at("to_s").get<double>(), all[i].to_s);
  }
}

// Terms that stand in no list: one of a rotor whose speed is read high, one with a state of its own.
struct FirstRotorReadsHigh {
  static constexpr std::string_view kId = "first_rotor_reads_high";
  static constexpr host::TermParameter kParameters[] = {{"error", "1", -0.2, 0.2, 0.03, 0.0}};
  template <class S>
  static void speeds(const S* c, host::LoadState<S>& s) {
    s.omega_rad_s[0] = s.omega_rad_s[0] / (1.0 + c[0]);
    s.omega_dot_rad_s2[0] = s.omega_dot_rad_s2[0] / (1.0 + c[0]);
  }
};
struct WakeThatStays {
  static constexpr std::string_view kId = "wake_that_stays";
  static constexpr host::TermParameter kParameters[] = {{"mass_kg", "kg", -0.1, 0.1, 1e-2, 0.0}};
  static constexpr host::TermMemory kMemory[] = {{{"start_m_s2", "m/s2", -10.0, 10.0, 0.1, 0.0}, 0.0}};
  template <class S>
  static void body(const S* c, host::LoadState<S>& s) {
    s.force_B_N.x -= c[0] * s.memory[0];
  }
  static void advance(const double*, const host::MemoryStep& step, double* memory) {
    memory[0] += step.dt_s / 0.2 * (step.acceleration_W_m_s2.x - memory[0]);
  }
};
constexpr host::Term kReadsHigh = host::make_term<FirstRotorReadsHigh>(), kStays = host::make_term<WakeThatStays>();

TEST(Diagnosis, OfATermAddedAtRunTimeReachesScreeningRefitVerdictTextPageAndResult) {
  DiagnoseOptions o = quick();
  o.library = {&kReadsHigh, &kStays};
  o.max_effects = 1;
  for (const host::CatalogueEffect& e : host::builtin_effect_catalogue().effects) {
    if (e.id != "com_offset" && e.id != "linear_drag") o.without.push_back(e.id);
  }
  const DiagnosisRun run =
      diagnose({.fitted = {read_high(model_true::Manoeuvre::vertical, 31), read_high(model_true::Manoeuvre::rotation, 33)}},
               testing_flights::vehicle(), o);
  const Diagnosis& d = run.diagnosis;
  std::vector<std::string> screened;
  for (const CandidateEvidence& e : d.rounds.front().candidates) screened.push_back(e.id);
  EXPECT_THAT(screened, ::testing::IsSupersetOf({"first_rotor_reads_high", "wake_that_stays", "com_offset", "linear_drag"}));
  ASSERT_EQ(d.added.size(), 1u);
  EXPECT_EQ(d.added.front().id, "first_rotor_reads_high");
  EXPECT_NEAR(d.added.front().parameters.front().value, 0.03, 0.003);
  EXPECT_EQ(d.verdict, DiagnosisVerdict::named);
  const nlohmann::ordered_json tree = diagnosis_tree(run, {});
  EXPECT_EQ(tree.at("added").front().at("id"), "first_rotor_reads_high");
  EXPECT_THAT(diagnosis_text(run), ::testing::HasSubstr("first_rotor_reads_high"));
  EXPECT_THAT(diagnosis_report_html(run, "paper"), ::testing::HasSubstr("first_rotor_reads_high"));
}

DiagnosisRun with_refits_of(int iterations) {
  DiagnoseOptions o = quick();
  o.library = {&kReadsHigh};
  o.max_effects = 1;
  for (const host::CatalogueEffect& e : host::builtin_effect_catalogue().effects) o.without.push_back(e.id);
  o.refit_iterations = iterations;
  return diagnose({.fitted = {read_high(model_true::Manoeuvre::vertical, 31), read_high(model_true::Manoeuvre::rotation, 33)}},
                  testing_flights::vehicle(), o);
}
// The same number of iterations on a busy machine and an idle one: the limit is counted, so it falls between two known numbers.
TEST(Diagnosis, ARefitIsJudgedWithExactlyTheIterationsThatItTakesAndNotWithOneLess) {
  const DiagnosisRun free = with_refits_of(200);
  ASSERT_EQ(free.diagnosis.added.size(), 1u);
  EXPECT_TRUE(free.diagnosis.not_judged.empty());
  const int taken = free.diagnosis.added.front().evidence.refit_iterations;
  ASSERT_GT(taken, 1);
  const DiagnosisRun enough = with_refits_of(taken);
  ASSERT_EQ(enough.diagnosis.added.size(), 1u);
  EXPECT_EQ(enough.diagnosis.added.front().parameters.front().value, free.diagnosis.added.front().parameters.front().value);
  EXPECT_EQ(enough.diagnosis.added.front().evidence.refit_iterations, taken);

  const DiagnosisRun short_of_one = with_refits_of(taken - 1);
  const Diagnosis& d = short_of_one.diagnosis;
  EXPECT_TRUE(d.added.empty());
  ASSERT_EQ(d.rounds.front().candidates.size(), 1u);
  EXPECT_EQ(d.rounds.front().candidates.front().ruled_out_by.id, Rejection::out_of_iterations);
  EXPECT_EQ(d.rounds.front().candidates.front().refit_iterations, taken - 1);
}
TEST(Diagnosis, AnEffectWhoseRefitIsNotDoneIsAReserveOnTheVerdictAndNamed) {
  const DiagnosisRun run = with_refits_of(1);
  const Diagnosis& d = run.diagnosis;
  EXPECT_TRUE(d.added.empty());
  EXPECT_EQ(d.not_judged, std::vector<std::string>{"first_rotor_reads_high"});
  EXPECT_THAT(d.remarks, ::testing::Contains(::testing::HasSubstr("first_rotor_reads_high was not judged")));
  EXPECT_EQ(diagnosis_tree(run, {}).at("not_judged"), nlohmann::ordered_json::array({"first_rotor_reads_high"}));
  const render::Outcome outcome = diagnosis_outcome(d, {});
  EXPECT_EQ(outcome.standing, render::Standing::open);
  EXPECT_THAT(outcome.sentence, ::testing::EndsWith("; not judged: first_rotor_reads_high."));
}

TEST(DiagnosisResult, VerdictRemarksAndLikelihoodsAreThoseOfTheValue) {
  const Diagnosis& d = diagnosed().diagnosis;
  EXPECT_EQ(written().at("verdict"), std::string(name(d.verdict)));
  EXPECT_EQ(written().at("white"), d.white);
  EXPECT_EQ(written().at("remarks").get<std::vector<std::string>>(), d.remarks);
  EXPECT_EQ(written().at("log_likelihood").at("before").get<double>(), diagnosed().before.fit.log_likelihood);
  EXPECT_EQ(written().at("log_likelihood").at("after").get<double>(), diagnosed().after.fit.log_likelihood);
}
TEST(DiagnosisResult, EveryEffectAddedStandsThereWithSizesAliasesShiftsAndAdvice) {
  const auto& added = diagnosed().diagnosis.added;
  ASSERT_FALSE(added.empty());
  ASSERT_EQ(written().at("added").size(), added.size());
  for (std::size_t i = 0; i < added.size(); ++i) {
    const json& j = written().at("added")[i];
    EXPECT_EQ(j.at("id"), added[i].id);
    expect_values(j.at("parameters"), added[i].parameters);
    expect_values(j.at("ratios"), added[i].ratios);
    EXPECT_EQ(j.at("determined"), ratios_text(added[i].ratios));
    EXPECT_EQ(j.at("manoeuvre"), added[i].manoeuvre);
    EXPECT_EQ(j.at("manoeuvre_search").at("manoeuvres").size(), added[i].advice.ranked.size());
    expect_evidence(j.at("evidence"), added[i].evidence);
    ASSERT_EQ(j.at("twins").size(), added[i].aliases.size());
    for (std::size_t t = 0; t < added[i].aliases.size(); ++t) {
      EXPECT_EQ(j.at("twins")[t].at("id"), added[i].aliases[t].id);
      EXPECT_EQ(j.at("twins")[t].at("correlation").get<double>(), added[i].aliases[t].correlation);
      EXPECT_EQ(j.at("twins")[t].at("gain_share").get<double>(), added[i].aliases[t].gain_share);
      expect_values(j.at("twins")[t].at("parameters"), added[i].aliases[t].parameters);
    }
    ASSERT_EQ(j.at("shifts").size(), added[i].shifts.size());
    for (std::size_t s = 0; s < added[i].shifts.size(); ++s) {
      EXPECT_EQ(j.at("shifts")[s].at("parameter"), added[i].shifts[s].first);
      EXPECT_EQ(j.at("shifts")[s].at("relative").get<double>(), added[i].shifts[s].second);
    }
  }
}
TEST(DiagnosisResult, EveryRoundStandsThereWithItsPlacebosAndEveryCandidateAndWhatWasRejected) {
  const Diagnosis& d = diagnosed().diagnosis;
  ASSERT_EQ(written().at("rounds").size(), d.rounds.size());
  for (std::size_t i = 0; i < d.rounds.size(); ++i) {
    const json& j = written().at("rounds")[i];
    EXPECT_EQ(j.at("placebos"), 20);
    EXPECT_EQ(j.at("placebo_level").get<double>(), d.rounds[i].placebos.level);
    EXPECT_EQ(j.at("placebo_wald").get<double>(), d.rounds[i].placebos.wald);
    EXPECT_EQ(j.at("decision"), d.rounds[i].decision);
    ASSERT_EQ(j.at("candidates").size(), d.rounds[i].candidates.size());
    for (std::size_t c = 0; c < d.rounds[i].candidates.size(); ++c) expect_evidence(j.at("candidates")[c], d.rounds[i].candidates[c]);
  }
  ASSERT_EQ(written().at("rejected").size(), d.rejected.size());
  for (std::size_t i = 0; i < d.rejected.size(); ++i) expect_evidence(written().at("rejected")[i], d.rejected[i]);
  ASSERT_EQ(written().at("not_observable").size(), d.not_observable.size());
  for (std::size_t i = 0; i < d.not_observable.size(); ++i) {
    const json& j = written().at("not_observable")[i];
    EXPECT_EQ(j.at("id"), d.not_observable[i].id);
    EXPECT_EQ(j.at("why"), d.not_observable[i].why);
    EXPECT_EQ(j.at("needs"), d.not_observable[i].needs);
    EXPECT_EQ(j.at("unit"), d.not_observable[i].unit);
    EXPECT_EQ(j.at("detectable").get<double>(), d.not_observable[i].detectable);
    EXPECT_EQ(j.at("typical").get<double>(), d.not_observable[i].typical);
  }
}
TEST(DiagnosisResult, EveryEstimateOfTheLastFitStandsThereWithItsUncertaintyAndUnit) {
  const identify::Identification& after = diagnosed().after;
  const json& all = written().at("estimates");
  ASSERT_GT(all.size(), 5u);
  ASSERT_EQ(all.size(), after.fit.estimates.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const estimate::Estimate& e = after.fit.estimates[i];
    EXPECT_EQ(all[i].at("name"), estimate::parameter_info(e.parameter, after.problem.start.terms).name);
    EXPECT_EQ(all[i].at("value").get<double>(), e.value);
    EXPECT_EQ(all[i].at("u").get<double>(), e.u);
  }
}
TEST(DiagnosisResult, WhatTheChecksTookOutIsAFaultOrLeftOutAndANoteIsNeither) {
  const Diagnosis& d = diagnosed().diagnosis;
  ASSERT_EQ(d.faults.size(), 1u);
  EXPECT_EQ(d.faults.front().what, "stands still");
  EXPECT_EQ(d.faults.front().flight, "vertical");
  ASSERT_EQ(d.left_out.size(), 1u);
  EXPECT_EQ(d.left_out.front().what, "on the ground");
  expect_faults(written().at("faults"), d.faults);
  expect_faults(written().at("left_out"), d.left_out);
}
TEST(DiagnosisResult, ErrorsOfTheFlightHeldOutAreThereAndResidualsHaveBeenLookedAt) {
  ASSERT_TRUE(diagnosed().held_out.has_value());
  EXPECT_EQ(written().at("held_out"), json::parse(identify::held_out_json(*diagnosed().held_out).dump()));
  ASSERT_TRUE(diagnosed().residuals.has_value());
  for (const std::string& word : diagnosed().residuals->words)
    EXPECT_NE(std::find(diagnosed().diagnosis.remarks.begin(), diagnosed().diagnosis.remarks.end(), word),
              diagnosed().diagnosis.remarks.end());
}
TEST(DiagnosisResult, TwentyPlacebosLeaveARemarkOfTheLevelThatTheyHave) {
  const auto& remarks = diagnosed().diagnosis.remarks;
  EXPECT_TRUE(std::any_of(remarks.begin(), remarks.end(), [](const std::string& r) { return r.find("95.2 %") != std::string::npos; }));
}

}  // namespace
}  // namespace rotorloop::diagnose
