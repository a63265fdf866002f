// What the sandboxed diagnosis says, as the bench reads it: the result.json that `rotorloop diagnose --report` writes. Read leniently: what
// a diagnosis leaves out is empty here, and the page shows what there is.
#pragma once
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace rotorloop::closed_loop {

struct FoundValue {
  std::string name, unit;
  double value = 0.0, u = 0.0;
};
struct FoundCandidate {
  std::string id, ruled_out_by;
  double wald = 0.0, gain_relative = 0.0, cross_validated = 0.0, p_holm = 1.0;
  std::vector<FoundValue> one_step;
};
struct FoundAlias {
  std::string id;
  std::vector<FoundValue> parameters;  // what it would be, were it this one
};
struct FoundEffect {
  std::string id, determined, manoeuvre;
  std::vector<FoundValue> parameters;
  std::vector<FoundAlias> aliases;  // indistinguishable from it in these flights
};
std::string alias_names(const FoundEffect& effect);  // "a, b"; empty: none
struct FoundRound {
  std::vector<FoundCandidate> candidates;  // best first
  double placebo_wald = 0.0;
  std::string decision;
  double placebo_level = 0.99;
};
struct FoundHeldOut {
  double horizon_s = 0.0;
  std::string quantity;
  double before = 0.0, after = 0.0, ratio = 1.0, low = 1.0, high = 1.0;
};
struct Findings {
  std::string verdict;  // "clean", "named", "ambiguous", "unexplained", "faulty"; empty: no diagnosis
  std::vector<FoundEffect> added;
  std::vector<FoundRound> rounds;
  std::vector<FoundHeldOut> held_out;
  std::vector<std::string> not_observable, faults, remarks;
};

// Throws Error (data_quality) for what is no JSON of a diagnosis.
Findings read_findings(const std::filesystem::path& result_json);

}  // namespace rotorloop::closed_loop
