// How well a model predicts a flight: from every start with its state given, the rotor speeds of the log drive the model open loop,
// and the error is taken after 1, 2, … steps. Means over starts, sums over horizons, intervals by paired block bootstrap.
// Protocol and error norms as in the IDSIA nano-drone benchmark (Busetto et al., Control Engineering Practice 172, 2026); any
// flight, step and horizon will do.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/estimate/noise_model.hpp"
#include "bench/sysid/score/state_track.hpp"

namespace rotorloop::score {

// Fills `out` with the states 1, 2, … steps after `start`. Looks at the state at `start` and at the rotor speeds, at nothing else.
using Predictor = std::function<void(const StateTrack& track, std::size_t start, std::span<estimate::BodyState> out)>;

// Nothing changes: the naive baseline.
Predictor state_held();
// Translation by the model, body rates as at the start: what the model's torque has to beat.
Predictor rates_held(const estimate::ModelValues& values);
// The whole model, in equal substeps of a step. Stateful terms start from the state of the track's input and are then propagated along the
// prediction.
Predictor whole_model(const estimate::ModelValues& values, int substeps = 1);

// The same with process noise of the given densities after each step: the same draws for the same seed, start and step.
Predictor noisy_model(const estimate::ModelValues& values, int substeps, const estimate::NoiseModel& noise, std::uint64_t seed);

enum PredictedQuantity : std::size_t { kPredictedPosition, kPredictedVelocity, kPredictedAttitude, kPredictedRates, kPredictedQuantities };
inline constexpr std::array<const char*, kPredictedQuantities> kPredictedUnits{"m", "m/s", "rad", "rad/s"};

// Errors of one flight: Euclidean norms; for attitude the angle between the two attitudes.
struct PredictionErrors {
  std::string flight;
  double step_s = 0.0;
  std::size_t horizon = 0;  // steps
  std::vector<std::size_t> starts;
  std::array<std::vector<double>, kPredictedQuantities> error;  // [index of start * horizon + steps - 1]

  double at(PredictedQuantity q, std::size_t start_index, std::size_t steps) const { return error[q][start_index * horizon + steps - 1]; }
};

// Every `stride`-th start from which `horizon` steps are known.
std::vector<std::size_t> prediction_starts(const StateTrack& track, std::size_t horizon, std::size_t stride = 1);
PredictionErrors predict(const StateTrack& track, const Predictor& predictor, std::span<const std::size_t> starts, std::size_t horizon);

// Pooled over flights, each start counting once.
struct PredictionSummary {
  double step_s = 0.0;
  std::size_t horizon = 0, starts = 0;
  std::array<std::vector<double>, kPredictedQuantities> mean;  // [steps - 1]
  std::array<double, kPredictedQuantities> sim_error{};        // sum of the means over all horizons, "SimErr"
};
PredictionSummary summary(std::span<const PredictionErrors> flights);

// Error of `a` over error of `b` on the same starts, summed over horizons from…to (steps, 1 to horizon): below 1 `a` is better.
// Interval: blocks of neighbouring starts are drawn with replacement (flights first when there are several), the same for both.
struct Bootstrap {
  double block_s = 2.0;
  int resamples = 2000;
  double level = 0.95;
  std::uint64_t seed = 1;
};
struct ErrorRatio {
  double value = 0.0, low = 0.0, high = 0.0;
};
ErrorRatio error_ratio(std::span<const PredictionErrors> a, std::span<const PredictionErrors> b, PredictedQuantity q, std::size_t from,
                       std::size_t to, const Bootstrap& bootstrap = {});

// Share of the avoidable error that is gone, (before - after) / (before - floor), on the same starts, with the same interval; not a
// number where no more than 2 % of the error before could be avoided.
ErrorRatio share_closed(std::span<const PredictionErrors> before, std::span<const PredictionErrors> after,
                        std::span<const PredictionErrors> floor, PredictedQuantity q, std::size_t from, std::size_t to,
                        const Bootstrap& bootstrap = {});

// Mean of the numbers of `a` less that of `b` at one horizon, on the same starts, with the same interval.
ErrorRatio mean_difference(std::span<const PredictionErrors> a, std::span<const PredictionErrors> b, PredictedQuantity q, std::size_t steps,
                           const Bootstrap& bootstrap = {});

// The longest run of horizons at each of which `a` errs less than `b` in the mean; both 0 when there is none.
struct HelpfulRange {
  double from_s = 0.0, to_s = 0.0;
};
HelpfulRange helpful_range(const PredictionSummary& a, const PredictionSummary& b, PredictedQuantity q);

}  // namespace rotorloop::score
