// How well a model predicts each pose of a flight from all measurements before it: innovations of the poses in metres and radians, in
// the sizes that model and noise figures let expect, and as a likelihood. Nothing is smoothed here: what a pose is compared with knows
// nothing of it, so these are the scores that hold at the shortest horizon there is.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/noise_model.hpp"
#include "bench/sysid/estimate/noise_search.hpp"
#include "bench/sysid/score/prediction.hpp"

namespace rotorloop::score {

// One flight under one model. `error` and `expected` hold position and attitude of the pose sensor, one start for each pose.
struct OneStepErrors {
  PredictionErrors error;           // measurement minus its prediction
  PredictionErrors expected;        // the same drawn anew from the predicted covariance: what a model that is right would err
  std::vector<double> squares;      // of each pose: sum over its six numbers, whitened; 6 under the model
  std::vector<double> log_density;  // of each pose, natural logarithm, in m and rad
};

// A flight with its poses associated with nodes (grid_flight.hpp) and, for stateful terms, with its motion. The first 0.25 s after each gap
// are left out: there the past does not fix the state. Empty without poses. `seed`: of the draws of `expected`.
OneStepErrors one_step(const estimate::GridFlight& flight, const estimate::ModelValues& values, const estimate::NoiseModel& noise,
                       std::uint64_t seed);

// Two models on the same flights.
struct OneStepComparison {
  std::size_t poses = 0;
  double step_s = 0.0;  // of the states: from one pose to the next where poses are as frequent or more so
  struct Row {
    PredictedQuantity quantity = kPredictedPosition;  // or attitude
    double before = 0.0, after = 0.0;                 // mean error
    ErrorRatio ratio;                                 // after / before
    double expected = 0.0;                            // mean error of the second model, were it and its noise figures right
  };
  std::vector<Row> rows;
  double size_before = 0.0, size_after = 0.0;                // rms of the whitened innovations: 1 when model and noise are right
  double log_density_before = 0.0, log_density_after = 0.0;  // mean of a pose
  ErrorRatio gain;  // after less before of the log density of a pose, same draws of blocks as the ratios; above 0 the second is better
};
// Throws Error when the two were not scored on the same poses. No rows without poses.
OneStepComparison compare(std::span<const OneStepErrors> before, std::span<const OneStepErrors> after);

// The noise figures under which `values` explain these flights best, parameters kept; `start` as it is where the search has no rounds.
estimate::NoiseModel noise_under(const estimate::ModelValues& values, std::span<const estimate::GridFlight> flights,
                                 std::span<const estimate::NoiseModel> start, const estimate::NoiseFit& search, int threads);

}  // namespace rotorloop::score
