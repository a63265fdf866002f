// Inertia about one axis from one band of frequencies: the model's torque against the gyro's slope. A rigid body has one inertia; when
// bands disagree, the torque model lacks something in one of them (a moment that goes with velocity shows below the attitude loop's
// bandwidth, a lag above it), and the inertia of a fit over all frequencies is a mixture of both. The measure of how much a fitted
// inertia can be trusted, independent of the fit.
// Left out: Ω x IΩ, so not for flights that tumble about several axes at once.
#pragma once
#include <optional>
#include <span>

#include "bench/log/flight_record.hpp"
#include "bench/estimate/model/parameters.hpp"

namespace rotorloop::score {

struct InertiaBand {
  int axis = 0;  // 0 roll, 1 pitch
  double from_Hz = 2.0, to_Hz = 15.0;
  std::optional<double> delay_s;  // of the torque before the gyro sees it; empty: the one that explains most, from -10 to 30 ms
  double segment_s = 3.0;         // Hann windows, half overlapping
};

struct BandInertia {
  double inertia_kg_m2 = 0.0;
  double u_kg_m2 = 0.0;  // from the scatter between segments
  double delay_s = 0.0;
  double explained = 0.0;  // share of the band's angular acceleration
  int segments = 0;
};

// Thrusts are those of `values` at the logged rotor speeds (or commands) and, when the log has pose and velocity, the logged velocity.
// Throws Error (data_quality) when a flight has no gyro, or when no flight is as long as one segment.
BandInertia inertia_in_band(std::span<const log::FlightRecord> flights, const estimate::ModelValues& values, const InertiaBand& band);

}  // namespace rotorloop::score
