// Parameters that make a model predict well: least squares of the open-loop error over many short windows (output error), where the
// fit of estimator.hpp takes every state for unknown and every step for disturbed. The two agree when the model is true. Where slow
// unknown moments act, or rotor speeds are noisy, this one pulls towards what pays in prediction: its parameters are for predicting
// and are no estimates of the vehicle's. It gives no uncertainties.
#pragma once
#include <array>
#include <vector>

#include "bench/sysid/score/prediction.hpp"

namespace rotorloop::score {

struct MultiStepOptions {
  std::size_t horizon = 50, stride = 40;  // steps; a window starts every `stride` steps
  // Errors are divided by these before they are squared; <= 0 leaves a quantity out. SI: m, m/s, rad, rad/s.
  std::array<double, kPredictedQuantities> scale{0.05, 0.2, 0.1, 0.5};
  double robust_scale = 0.5;  // scaled errors beyond it count linearly (pseudo-Huber); 0: plain squares
  int substeps = 1;
  int max_iterations = 25;
  double tolerance = 1e-4;  // relative fall of the cost that ends the iteration
};

struct MultiStepFit {
  estimate::ModelValues values;
  double cost = 0.0;  // mean over windows and steps
  int iterations = 0;
  bool converged = false;
};

// `free`: parameters of the dynamics or of terms. They stay within the bounds of parameter_info().
MultiStepFit fit_multi_step(const estimate::ModelValues& start, const estimate::Columns& free, const std::vector<StateTrack>& tracks,
                            const MultiStepOptions& options = {});

}  // namespace rotorloop::score
