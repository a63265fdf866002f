// The whole diagnosis: fit with what the vehicle file holds, screen every effect against what is left, add the best one that passes
// every criterion, refit in full, screen again; at the end take out what the others made needless. Nothing here prints or reads files.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bench/diagnose/diagnosis.hpp"
#include "bench/diagnose/screening.hpp"
#include "bench/identify/identify.hpp"

namespace rotorloop::bench {

// When an effect is taken for real. All must hold.
struct Criteria {
  double p = 0.01;                // of the block-robust statistic, after Holm
  double relevant = 0.1;          // of the size that matters (a term's scale): a smaller effect is left out, however certain
  double gain_per_reading = 0.0;  // least gain of log likelihood over the number of readings
  double held_share = 0.25;       // of its gain that must also show on blocks that did not estimate it
  double twin_bic = 3.0;          // difference of the criterion within which two effects are not told apart …
  double twin_correlation = 0.7;  // … or up to twice that difference, when their columns correlate so much
  double fewest_u = 3.3;          // estimate over its robust standard error, after the refit
};

struct DiagnoseOptions {
  IdentifyOptions identify;
  Criteria criteria;
  std::vector<std::string> without;             // effects that are not considered
  std::vector<const host::Term*> library = {};  // candidates beside those of host/effects: a user's own
  bool beliefs = true;                          // what the vehicle file knows (not guesses) counts as knowledge
  double block_s = 1.0;
  int max_effects = 6;
  std::size_t placebos = 100;
  std::uint64_t seed = 1;
};

struct DiagnoseProgress {
  std::string part;   // "baseline fit", "screening 44 effects", "refit with rotor_inertia_reaction"
  double done = 0.0;  // share of the work expected, 0 to 1
};

struct DiagnosisRun {
  Diagnosis diagnosis;
  Identification before, after;  // the model of the vehicle file refitted, and that with the effects
};

// Throws like identify().
DiagnosisRun diagnose(const std::vector<FlightToFit>& flights, const host::VehicleFile& vehicle, const DiagnoseOptions& options,
                      const std::function<void(const DiagnoseProgress&)>& progress = {});

// What the residuals of the last model say by themselves: a systematic rest or bursts without an effect found make it `unexplained`.
struct ResidualFindings;
void judge_residuals(const ResidualFindings& left, Diagnosis& diagnosis);

}  // namespace rotorloop::bench
