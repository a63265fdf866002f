// Many trials against the truth: bias, scatter, and whether the standard errors that came with the estimates are right.
#pragma once
#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "test/stats/identify_trial.hpp"

namespace rotorloop::stats {

// Of one quantity over all trials. Relative quantities are in units of the truth, others in their own.
struct QuantityResult {
  double mean_error = 0.0;
  double rms_error = 0.0;
  double mean_u = 0.0;     // root mean square of the classical standard errors: the Cramér-Rao bound at the estimates
  double within_2u = 0.0;  // share of trials with |error| <= 2 u
  double rms_z = 0.0;      // of error / u
  double mean_z = 0.0;     // 0 for an estimate without bias; its own scatter is 1 / sqrt(trials)
  double within_2u_robust = 0.0;
};
struct EnsembleResult {
  std::size_t trials = 0, not_converged = 0;
  std::vector<QuantityResult> quantity;                                              // in the order of the quantities given
  double pooled_within_2u = 0.0, pooled_rms_z = 0.0, pooled_within_2u_robust = 0.0;  // over parameters, not derived quantities
};
EnsembleResult summarise(const std::vector<Quantity>& quantities, const std::vector<Trial>& trials);

// What is asked of the ensemble; the limits of scatter stand in quantities().
struct EnsembleLimits {
  double pooled_from = 0.93, pooled_to = 0.975;
  double each_from = 0.90, each_to = 0.99;
  double rms_z_from = 0.85, rms_z_to = 1.15;  // each parameter and pooled
};
// One line for each limit that is missed, in words with figures; empty when all are met.
std::vector<std::string> missed(const std::vector<Quantity>& quantities, const EnsembleResult& result, const EnsembleLimits& limits = {});

// The table of docs/acceptance, Markdown.
void print_table(std::ostream& out, const std::vector<Quantity>& quantities, const EnsembleResult& result);

// What a changed condition does to the estimates, free of the scatter that both have in common: mean of (changed - usual) over the
// seeds that both have, with its standard error, beside the standard error of one estimate.
void print_shift(std::ostream& out, const std::vector<Quantity>& quantities, const std::vector<Trial>& changed,
                 const std::vector<Trial>& usual);

// A trial is one line of a CSV file; the header names the quantities. Lines that a crash cut short are dropped on reading.
std::string csv_header(const std::vector<Quantity>& quantities);
std::string csv_line(const Trial& trial);
std::vector<Trial> read_trials(const std::filesystem::path& file, std::size_t quantities);

}  // namespace rotorloop::stats
