// The motion of a flight as dynamic terms follow it: smoothed states, sound at every node.
#pragma once
#include <span>
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/model/dynamic_term_input.hpp"
#include "bench/sysid/estimate/noise_model.hpp"

namespace rotorloop::estimate {

// States where the model ties them, straight lines and shortest turns across the rest. A load that swings through a gap of 80 ms feels
// the mean acceleration of the gap.
Motion motion_of(const GridFlight& flight, const std::vector<BodyState>& states);

// States that the measurements make, not the model: smoothed under ten times the process noise that models of small multirotors leave.
// `noise` says how good the measurements are.
std::vector<BodyState> states_by_measurements(const GridFlight& flight, const ModelValues& values, const NoiseModel& noise);

// Propagates the stateful terms of each flight along its states.
void follow_states(std::span<GridFlight> flights, std::span<const std::vector<BodyState>> states);

}  // namespace rotorloop::estimate
