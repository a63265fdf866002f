// Two run folders side by side, from their files alone: are the logs the same to the bit, and if not, which figures differ
// by more than their spread over seeds explains.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/flight/run_folder.hpp"

namespace rotorloop::hil {

struct ComparedFigure {
  std::string flight;
  Variant variant = Variant::pd_ff;
  std::string name, unit;             // "mean_error_3d", "cm"
  Spread a, b;                        // over the seeds of each run
  double difference = kNotMeasured;   // b - a: mean over seeds flown in both, or of the means when there are none
  double uncertainty = kNotMeasured;  // half width of its 99 % interval (Student); 0 when fewer than two pairs give no spread
  int pairs = 0;                      // seeds flown in both; 0: the runs share no seed and Welch's interval is used
  bool significant = false;           // |difference| > uncertainty
};

struct Comparison {
  std::string name_a, name_b;  // of the folders
  RunResult a, b;
  bool logs_identical = false;              // the same logs with the same bytes
  std::vector<std::string> differing_logs;  // in both, other bytes
  std::vector<std::string> only_in_a, only_in_b;
  std::vector<std::string> differing_inputs;  // path of inputs that one lacks or that differ
  std::vector<ComparedFigure> figures;
  bool logs_compared = false;        // both runs have logs
  bool differs = false;              // a figure differs significantly, or a flight or its end is not the same in both
  std::vector<std::string> reasons;  // sentences for `differs`
};

// `verify`: hash the logs on disk again instead of trusting result.json; a log that does not fit its result.json throws
// Error (ExitCode::data_quality), and so do runs without logs. Two runs that have neither logs nor flights in common are nothing that could
// be compared: Error (ExitCode::data_quality).
Comparison compare_runs(const std::filesystem::path& a, const std::filesystem::path& b, bool verify);

std::string comparison_text(const Comparison& c);
std::string comparison_json_text(const Comparison& c);

}  // namespace rotorloop::hil
