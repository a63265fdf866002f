// Where a fit starts: the vehicle file's values, with thrust scaled until it carries the weight over the flights. A thrust model that
// is off by a factor (RPM for rad/s, another propeller) would else send the first step far away.
#pragma once
#include <span>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::identify {

struct StartValues {
  estimate::ModelValues values;
  estimate::ModelValues file;  // as the vehicle file says, before any scaling: what estimates are compared with, and priors are about
  double thrust_scale = 1.0;   // by which k1, k2 and c_q of the vehicle file were multiplied; 1: they carry the weight within 10 %
};

// The mean vertical acceleration of a flight is next to nothing: Σ c_t ω² cos(tilt) over the flight is its weight. With commands the
// gain is set instead, k1 kept. Flights without attitude count as level.
StartValues start_values(std::span<const estimate::GridFlight> flights, const host::VehicleFile& vehicle, const host::TermList& terms);

// Of a flight; 0 when its log has no voltage.
double mean_battery_V(const estimate::GridFlight& flight);

}  // namespace rotorloop::identify
