#include "bench/sysid/diagnose/diagnose.hpp"

#include <algorithm>

#include "bench/sysid/diagnose/manoeuvre/manoeuvre_search.hpp"
#include "bench/sysid/diagnose/remarks.hpp"
#include "bench/sysid/diagnose/residual_verdict.hpp"
#include "bench/sysid/diagnose/stepwise_search.hpp"
#include "bench/sysid/diagnose/vehicle_priors.hpp"
#include "bench/sysid/identify/whiteness.hpp"

namespace rotorloop::diagnose {
namespace {

bool innovations_white(const identify::Identification& r) {
  for (std::size_t f = 0; f < r.fit.reduced.size(); ++f) {
    if (!r.fit.reduced[f].innovations.empty() && !identify::whiteness_of(r.flights[f].name, r.fit.reduced[f].innovations).white())
      return false;
  }
  return true;
}

// What the search found, as far as it came.
void report_model(StepwiseSearch& search, const DiagnoseOptions& o, DiagnosisRun& out) {
  Diagnosis& d = out.diagnosis;
  search.report_sizes();
  search.report_pose_time_offset();
  search.report_unobservable_in_flight();
  out.after = std::move(search).model();
  d.remarks.push_back(measurements_used(out.after));
  if (!d.rounds.empty()) note_placebos(o.criteria, d);
  if (out.after.fit.converged) note_contradictions(out.after, d);
  d.white = innovations_white(out.after);
  const bool ambiguous = std::any_of(d.added.begin(), d.added.end(), [](const AddedEffect& a) { return !a.aliases.empty(); });
  d.verdict = ambiguous ? DiagnosisVerdict::ambiguous : d.added.empty() ? DiagnosisVerdict::clean : DiagnosisVerdict::named;
  const estimate::ModelValues& start = out.after.problem.start;
  for (const host::Term& term : host::all_terms()) {
    const host::TermTraits& traits = term.info.traits;
    if (!host::can_act(term, start.geometry))
      d.not_observable.push_back({std::string(term.info.id), std::string(traits.unknown), std::string(traits.needs), 0.0, 0.0,
                                  std::string(term.info.parameters.front().unit)});
  }
}

// What is left of the flights, and flights held out.
void judge_what_is_left(const FlightsToDiagnose& flights, const DiagnoseOptions& o, const StepwiseSearch::Say& say, DiagnosisRun& out) {
  const estimate::StopFit stop = o.identify.fit.stop;
  Diagnosis& d = out.diagnosis;
  stop.check();
  if (out.after.problem.flights.front()->pose.empty()) {
    d.remarks.push_back("flights without poses: residuals are not looked at by themselves");
  } else {
    say("analysis of the residuals", 0.95);
    out.residuals = analyse_residuals(out.after, {.seed = o.seed, .logs = flights.fitted, .criteria = o.criteria});
    judge_residuals(*out.residuals, out.after.problem.start, d, o.without, o.criteria);
    if (!d.added.empty() && !d.remains.empty()) {
      const ResidualFindings before = analyse_residuals(out.before, {.seed = o.seed, .logs = flights.fitted, .criteria = o.criteria});
      judge_explained(before, *out.residuals, out.after.problem.start, d, o.criteria);
    }
  }
  stop.check();
  if (!flights.held_out.empty()) {
    say("score of the held-out flights", 0.97);
    out.held_out = identify::score_models(flights.held_out, out.before, out.after, o.identify.grid, o.wrench_band);
    judge_held_out(*out.held_out, d, o.criteria);
  }
}

}  // namespace

DiagnosisRun diagnose(const FlightsToDiagnose& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& o,
                      const std::function<void(const DiagnoseProgress&)>& progress) {
  std::string part;
  const StepwiseSearch::Say say = [&](const std::string& next, double done) {
    part = next;
    if (progress) progress({next, done});
  };
  DiagnosisRun out;
  Diagnosis& d = out.diagnosis;

  say("fit of the nominal model", 0.0);
  identify::IdentifyOptions first = o.identify;
  if (o.priors) first.priors = vehicle_priors;
  first.fit.innovations = true;
  out.before = identify::identify(flights.fitted, vehicle, first);

  StepwiseSearch search(o, first.fit, out.before, d);
  bool stopped = false;
  try {
    for (int round = 0; search.forward_step(round, say);) ++round;
    search.backward_elimination(say);
  } catch (const estimate::FitStopped&) {
    stopped = true;
  }
  report_model(search, o, out);
  report_checks(flights, d);
  add_words(out.after.problem.start, flights.rotor_columns, o.criteria, d);
  try {
    if (!stopped) {
      choose_manoeuvres(out, o.library, o.identify.fit.threads, o.identify.fit.stop);
      judge_what_is_left(flights, o, say, out);
    }
  } catch (const estimate::FitStopped&) {
    stopped = true;
  }
  if (stopped) {
    d.verdict = DiagnosisVerdict::incomplete;
    d.remarks.insert(d.remarks.begin(), "stopped during: " + part + "; what stands here was found before");
  } else {
    say("done", 1.0);
  }
  return out;
}

}  // namespace rotorloop::diagnose
