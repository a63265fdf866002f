// What a diagnosis says, for text, JSON, the page and other programs: the verdict, the effects it names with the evidence for and
// against each candidate, what these flights could not have shown, and the error before and after. Data only.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/placebo_limit.hpp"
#include "bench/sysid/diagnose/rejection.hpp"
#include "bench/sysid/diagnose/residuals/residual_findings.hpp"
#include "bench/sysid/diagnose/verdict.hpp"
#include "bench/sysid/identify/held_out.hpp"
#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::diagnose {

// One effect of the library against the residual of one model.
struct CandidateEvidence {
  std::string id;                    // effects/catalogue.toml, or that of a user's term
  std::vector<NamedValue> one_step;  // estimate of its parameters from the screening, without a refit
  double chi2 = 0.0;                 // classical score statistic
  double wald = 0.0;                 // block-robust, over its degrees of freedom: an F statistic
  int degrees = 0;
  double p = 1.0, p_holm = 1.0;       // of the robust statistic; Holm over all candidates
  double gain = 0.0;                  // predicted Δ log-likelihood, deflated for correlated residuals
  double gain_relative = 0.0;         // predicted fall of the misfit that the model's errors cause, 0 to 1
  double bic = 0.0;                   // gain less ½ d log(n_eff)
  double cross_validated = 0.0;       // Δ log-likelihood on blocks or flights that did not estimate it, deflated likewise
  double delta_log_likelihood = 0.0;  // of the refit with it; 0: it was not refitted
  int refit_iterations = 0;           // that the refit took, in all its fits
  // Of the refit, score_table.hpp: how much its size varies from stretch to stretch, over that size; by how much the stretches scatter.
  double variation = 0.0, scatter = 1.0;
  double optimism =
      0.0;  // of that refit beyond the one without it: what its Δ log-likelihood loses on stretches left out (score_table.hpp)
  double relative_size = 0.0;  // its largest number over what matters of it; of the refit where there was one
  bool inside_bounds = true;   // of its physical range, within two u
  Reason ruled_out_by = {};    // first criterion it fails; none: it could be the missing effect
  // Detection limit of these flights (3.3 u), of its first parameter, and what is typical (catalogue).
  double detectable = 0.0, typical = 0.0;
};

struct ClassMember {
  std::string id;
  double correlation = 0.0;  // canonical, with the best, after the model's parameters took their share
  double gain_share = 0.0;   // its gain over that of the best
  std::vector<NamedValue> parameters;
};

// What a flight of a class's manoeuvre would add (manoeuvre_search.hpp).
struct ManoeuvreValue {
  std::string id, words;
  std::vector<double> separation;  // from each of the aliases below: Δ log-likelihood that the manoeuvre is expected to bring
  double least = 0.0;              // of those that any manoeuvre separates
};
struct ManoeuvreAdvice {
  double seconds = 0.0;                 // of each manoeuvre
  std::vector<std::string> aliases;     // in the order of the separations
  std::vector<double> reached;          // from each alias, by the manoeuvre that separates it best
  std::vector<std::string> open;        // aliases that no manoeuvre separates
  std::vector<ManoeuvreValue> ranked;   // best first
  std::vector<std::string> impossible;  // manoeuvres that rotors or room do not allow
};

// One effect that was added.
struct AddedEffect {
  std::string id = {};                      // the best of the class, or the effect itself
  std::vector<NamedValue> parameters = {};  // after the refit
  std::vector<ClassMember> aliases = {};    // indistinguishable from it in these flights; empty: named
  std::vector<NamedValue> ratios = {};      // of its parameters to scales of the vehicle, where determined much better (ratios.hpp)
  std::string in_words = {};                // its size as a mechanic says it: "rotor 3 (front left) 5.1 %"
  std::string next = {};                    // what a person does about it; empty: writes it into the vehicle file
  std::string manoeuvre = {};               // for a class: the flight that would separate its members
  ManoeuvreAdvice advice = {};              // … and how well, in simulation
  CandidateEvidence evidence = {};
  std::vector<std::pair<std::string, double>> shifts = {};  // parameters of the model that it moved by more than one u: relative change
};

// A sweep of all candidates, and what was done upon it.
struct DiagnosisRound {
  std::vector<CandidateEvidence> candidates;  // best first
  PlaceboLimit placebos;
  std::string decision;  // in words: "added rotor_inertia_reaction", "nothing passes every criterion"
};

// An effect whose detection limit in these flights is above its typical size, or that no flight shows.
struct NotObservable {
  std::string id, why, needs;
  double detectable = 0.0, typical = 0.0;
  std::string unit;
};

// Something the checks of the logs took out: a fault of a sensor or stream, or what is only left out.
struct LogFault {
  std::string flight, stream, what;
  double from_s = 0.0, to_s = 0.0;
};

// What the last model leaves that matters to the vehicle and is no noise.
enum class RemainingKind {
  systematic,  // of an axis of the residual wrench a share of the power is predictable on blocks that had no part in the prediction
  bursts,      // …, or stands in short stretches
  noise,       // the fitted noise of an axis is far above its residual: whatever is missing passes for noise
  held_out,    // errors on flights held out are not those of a model that is right
};
std::string_view name(RemainingKind kind);  // "systematic"

struct RemainingResidual {
  RemainingKind kind = RemainingKind::systematic;
  std::string axis, unit;  // "force z", "N"; held_out: the quantity and its horizon
  double share = 0.0;      // of the power: predictable, or in bursts; noise, held_out: size over `matters`
  double beyond = 0.0;     // rms beyond what the noise figures expect; bursts: what they alone make of it; noise: expected; held_out: error
  double matters = 0.0;    // the limit of that; noise: the residual; held_out: the floor
  std::string flight = {};  // in which alone it stands; empty: over all
  std::string words = {};   // more, for a person: where bursts are
};

struct Diagnosis {
  DiagnosisVerdict verdict = DiagnosisVerdict::clean;
  std::vector<LogFault> faults;    // a sensor or its stream is wrong
  std::vector<LogFault> left_out;  // no fault: on the ground, before a stream begins or after it ends
  std::vector<AddedEffect> added;  // in the order they were found
  std::vector<DiagnosisRound> rounds;
  std::vector<CandidateEvidence> rejected;  // effects that were tried in a full refit and taken out again, and why
  std::vector<std::string> not_judged;      // effects whose refit was not done within its iterations: a reserve on every verdict
  std::vector<NotObservable> not_observable;
  std::vector<RemainingResidual> remains;  // with effects added: named, and something remains. Without: what makes it `unexplained`
  bool white = true;                       // innovations after the last round
  std::vector<std::string> remarks;        // in words, most important first
};

// With what it is read from.
struct DiagnosisRun {
  Diagnosis diagnosis;
  identify::Identification before, after;           // the model of the vehicle file refitted, and that with the effects
  std::optional<ResidualFindings> residuals;        // of the model after; none where flights have no poses
  std::optional<identify::HeldOutScores> held_out;  // none without flights held out
};

}  // namespace rotorloop::diagnose
