// How far a model that were exactly right would err on a flight: the start comes from noisy measurements, noise acts on the way, and what
// is predicted is compared with measurements that are noisy too. No model can be expected to do better, so this is what errors are measured
// from.
#pragma once
#include <cstdint>
#include <span>

#include "bench/sysid/estimate/noise_model.hpp"
#include "bench/sysid/score/prediction.hpp"

namespace rotorloop::score {

// `track`: the states that the measurements of `flight` make. Noise as large as `noise` says is drawn once more on top of the measurements,
// the states are made again, and the model predicts from them with process noise: how far it then ends from where it ended without, less
// how far the measurements moved there. `smoothed_with`: the measurement noise that `track` was made with.
PredictionErrors noise_floor(const estimate::GridFlight& flight, const StateTrack& track, const estimate::ModelValues& values,
                             const estimate::NoiseModel& smoothed_with, const estimate::NoiseModel& noise,
                             std::span<const std::size_t> starts, std::size_t horizon, std::uint64_t seed);

}  // namespace rotorloop::score
