// What a flight that had no part in the fit says of itself before anything is predicted: its states, and the state of terms at its start.
#pragma once
#include "bench/sysid/identify/identify.hpp"
#include "bench/sysid/score/prediction.hpp"

namespace rotorloop::identify {

// The state of the terms where the flight begins is found from the flight, as its states are; nothing else is.
estimate::ModelValues with_starts(const estimate::GridFlight& flight, const estimate::ModelValues& values,
                                  const estimate::NoiseModel& noise);

// A held-out flight as predictions start from it: states that the measurements make, stateful terms propagated along them under the fit's
// values.
score::StateTrack held_out_track(estimate::GridFlight& flight, const Identification& result);

}  // namespace rotorloop::identify
