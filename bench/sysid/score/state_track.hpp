// A flight as a sequence of known states at equal distance with the rotor speeds that drove it: what a prediction starts from and is
// scored against. Made from a log's own state estimate with low-pass filters, or from the smoothed states of a fit.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/model/model.hpp"
#include "bench/sysid/estimate/model/rotor_input.hpp"

namespace rotorloop::score {

struct StateTrack {
  std::string name;
  double start_s = 0.0, step_s = 0.01;
  std::vector<estimate::BodyState> state;  // at start_s + k step_s
  estimate::RotorInput input;              // prepared; its clock is that of the states

  double time_s(std::size_t k) const { return start_s + static_cast<double>(k) * step_s; }
};

// Cut-offs of the zero-phase fourth-order low-pass; 0: none. The defaults are those of the IDSIA nano-drone benchmark (Busetto et al.,
// Control Engineering Practice 172, 2026), whose logs come on a grid of 100 Hz.
struct TrackFilter {
  double rate_Hz = 100.0;
  double position_Hz = 10.0, velocity_Hz = 18.0, attitude_Hz = 18.0, rates_Hz = 18.0, rotor_Hz = 20.0;
  double largest_rotor_rad_s = 5236.0, largest_rotor_jump_rad_s = 1745.0;  // 5e4 and 1.67e4 RPM: beyond are spikes
};

// From the streams pose, velocity (or the slope of the position where the log has none), gyro and rotor speeds; the pose sensor is taken to
// sit in the centre of mass along the body axes. Throws Error (data_quality) naming the stream that is missing.
StateTrack filtered_track(const log::FlightRecord& record, const TrackFilter& filter = {});

// From the states of a fit: a grid flight and one state for each of its nodes.
StateTrack fitted_track(const estimate::GridFlight& flight, const std::vector<estimate::BodyState>& states,
                        const estimate::ModelValues& values);

}  // namespace rotorloop::score
