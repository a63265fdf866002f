// What a missing load may depend on, sample by sample: motion, place, rotors, battery. From the fitted states and the logged rotor
// speeds alone. Angular acceleration is not among them: the fitted one contains the residual itself.
#pragma once
#include <vector>

#include "bench/sysid/diagnose/residuals/sample_state.hpp"
#include "bench/sysid/diagnose/residuals/samples.hpp"
#include "bench/sysid/estimate/grid_flight.hpp"

namespace rotorloop::diagnose {

// All inputs, empty.
std::vector<Channel> input_channels();
// Products of rates and speeds of the body, of those channels: loads that no sum of functions of one input each can follow.
std::vector<Channel> products_of_motion(const std::vector<Channel>& inputs);

// One flight's samples: appended to `state` and to each channel; `wrench` becomes as long and holds the model's wrench at the middle of
// each step (N, N m, body axes).
void add_flight_inputs(const estimate::GridFlight& flight, const estimate::ModelValues& values,
                       const std::vector<estimate::BodyState>& states, std::vector<SampleState>& state, std::vector<Channel>& inputs,
                       Axes& wrench);

}  // namespace rotorloop::diagnose
