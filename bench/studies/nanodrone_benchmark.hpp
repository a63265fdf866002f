// The IDSIA nano-drone benchmark as a study: models fitted on the square, random and multisine flights of a 45 g quadrotor, scored on
// the melon flight by the published protocol, beside the published results and the published physics computed anew on the same file.
// R. Busetto et al., "Nonlinear system identification for a nano-drone benchmark", Control Engineering Practice 172 (2026) 106871.
#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"
#include "bench/sysid/score/prediction.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::studies {

struct NanodroneInputs {
  std::filesystem::path flights;    // folder of the CSV files
  std::filesystem::path mapping;    // what their columns mean
  host::VehicleModel vehicle;       // mass, arms, inertia, propeller; the rest are start values
  bool maximum_likelihood = false;  // also the fit of estimator.hpp on one flight of each kind: about a minute more
  score::Bootstrap bootstrap;
};

struct NanodroneScore {
  std::string model;
  score::PredictionSummary score;
};

// A score that is judged: at most `share` of the smaller of the published best and the recomputed baseline.
struct NanodroneLimit {
  score::PredictedQuantity quantity = score::kPredictedPosition;
  double published_best = 0.0, baseline = 0.0, share = 1.0;
  double limit = 0.0, measured = 0.0;
  score::ErrorRatio to_baseline;  // measured over baseline, paired
  bool met = false;
};

// How the whole model compares with its own translation and constant rates, at one horizon.
struct NanodroneHorizon {
  double horizon_s = 0.0;
  score::ErrorRatio attitude, rates;
};

struct NanodroneResult {
  std::vector<std::string> training;
  std::vector<NanodroneScore> scores;  // in order of the steps that were taken
  std::array<NanodroneLimit, score::kPredictedQuantities> limits;
  std::vector<NanodroneHorizon> horizons;
  // Horizons to 2 s at which the rotation model beats constant rates; and that of the maximum-likelihood fit, when it was made.
  score::HelpfulRange attitude_helps, rates_help, likelihood_rates_help;
  double k_F_N_s2 = 0.0;  // static thrust coefficient of the translation fit
  estimate::ModelValues predicting;
  std::vector<int> predicting_free;         // its parameters that were fitted
  std::optional<estimate::Fit> likelihood;  // physical parameters, with the names of its estimates
  std::vector<std::string> likelihood_names;

  bool met() const;
};

inline constexpr double kNanodronePublishedK_F_N_s2 = 3.72e-8;
inline constexpr double kNanodroneK_F_tolerance = 0.02;

// Throws Error (data_quality) when the folder lacks training or test flights. `progress` gets one line a step.
NanodroneResult run_nanodrone(const NanodroneInputs& inputs, const std::function<void(const std::string&)>& progress = {});

}  // namespace rotorloop::studies
