// Did a constant of the vehicle change at some moment: a blade that broke, a load that was dropped, something that came loose? For each
// flight and each kind of change, the moment at which a step fits the smoothed residuals best, against the same search over the flight's
// blocks in random order, which keeps everything but the moment.
#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "bench/sysid/diagnose/residuals/residual_series.hpp"

namespace rotorloop::diagnose {

// A kind of step: the body wrench (N, N m) that one unit of it adds at a sample.
struct StepKind {
  std::string effect, parameter, unit;  // effects/catalogue.toml
  std::vector<Eigen::Matrix<double, 6, 1>> wrench;
};
std::vector<StepKind> step_kinds(std::span<const SampleState> state);

struct TimeStep {
  std::size_t flight = 0;
  std::string effect, parameter, unit;
  double at_s = 0.0;
  double size = 0.0, u = 0.0;      // after minus before; u from the scatter of blocks
  double chi2 = 0.0, limit = 0.0;  // of the best moment; 99th percentile over blocks in random order, the step taken out
  double p = 1.0, p_holm = 1.0;    // Holm over all flights and kinds
  bool matters = true;             // StepOptions::matters
  std::vector<double> tried_s, chi2_at;
};
struct StepsResult {
  std::vector<TimeStep> steps;  // the best of each flight and kind, smallest p first, then largest chi2 over limit
  // Of one flight, steps that matter and pass at 1 % and whose moments lie within a second are the same event: the first is the likeliest.
  std::vector<std::vector<std::size_t>> events;
  std::vector<std::vector<std::size_t>> too_small;  // the same of those that pass and do not matter
  std::array<double, 6> matters{};                  // StepOptions::matters
};

struct StepOptions {
  double block_s = 1.5, grid_s = 0.25;  // blocks at least so long, and four times the correlation time
  double margin = 0.08;                 // share of the flight at either end in which no step is sought
  int resamples = 999;
  // Of force (N) and torque (N m): a step that alone makes a smaller rms than that on every axis, its mean over the flight taken out, is
  // none. The laws of a sound model leave as much that changes with the manoeuvres of a flight, and blocks in random order are no test of
  // that.
  std::array<double, 6> matters{};
  std::uint64_t seed = 1;
};
StepsResult steps_in_time(const ResidualSeries& series, std::span<const StepKind> kinds, const StepOptions& options = {});

// The search itself, on one series of local scores and their information on an even grid: chi2 of a step after each point.
std::vector<double> step_statistic(std::span<const double> score, std::span<const double> information);

}  // namespace rotorloop::diagnose
