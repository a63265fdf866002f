// How large the noise of measurements can be, by the measurements alone: the scatter of each about the straight line between its neighbours
// holds all of its white noise, and of the motion only what bends within two samples. A fit without such a limit calls errors of a slow
// kind, which the model should explain, noise, and no longer listens to the stream: a gyro against a wrong delay, a heading that sways.
#pragma once
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/noise_model.hpp"

namespace rotorloop::estimate {

// Infinite for the process, and for measurements of which there are too few to say.
NoiseModel noise_limits(const GridFlight& flight);
// Of several flights with one noise: root mean squares.
NoiseModel pooled_limits(const std::vector<NoiseModel>& flights);
// Each figure, but none above its limit.
NoiseModel within(const NoiseModel& noise, const NoiseModel& limits);

}  // namespace rotorloop::estimate
