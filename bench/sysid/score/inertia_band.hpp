// Inertia from one band of frequencies: the model's torque against the slope of the measured rates. A rigid body has one inertia; when
// bands disagree, the torque model lacks something in one of them (a moment that goes with velocity shows below the attitude loop's
// bandwidth, a lag above it), and the inertia of a fit over all frequencies is a mixture of both. The measure of how much a fitted
// inertia can be trusted, independent of the fit.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::score {

// A piece of a flight without gaps on common samples.
struct BandSeries {
  std::vector<Eigen::Vector3d> torque_N_m;               // of the model, less Ω x IΩ, B
  std::vector<Eigen::Vector3d> rate_rad_s;               // measured, B
  double rate_interval_s = 0.0, rotor_interval_s = 0.0;  // of the logged readings, between which the samples are straight lines
};

// From the log alone: at the logged pose and velocity when it has both, else as in hover. Throws Error (data_quality) for a log without
// gyro.
std::vector<BandSeries> band_series(const log::FlightRecord& flight, const estimate::ModelValues& values);
// Along `states` of the grid. Rates from the gyro where the grid has it, else from the slope of the poses' attitude; empty without either.
std::vector<BandSeries> band_series(const log::FlightRecord& flight, const estimate::GridFlight& grid,
                                    const std::vector<estimate::BodyState>& states, const estimate::ModelValues& values);

struct InertiaBand {
  int axis = 0;  // 0 roll, 1 pitch
  double from_Hz = 2.0, to_Hz = 15.0;
  std::optional<double> delay_s;  // of the torque before the rates show it; empty: the one that explains most, from -60 to 60 ms
  double segment_s = 3.0;         // Hann windows, half overlapping
};

struct BandInertia {
  double inertia_kg_m2 = 0.0;
  double u_kg_m2 = 0.0;  // from the scatter between segments
  double delay_s = 0.0;
  double explained = 0.0;  // share of the band's angular acceleration
  int segments = 0;
};

// Empty when no piece is as long as one segment, or no frequency of a segment lies in the band.
std::optional<BandInertia> inertia_in_band(std::span<const BandSeries> pieces, const InertiaBand& band);
// The same from the logs alone; that is an Error (data_quality) here.
BandInertia inertia_in_band(std::span<const log::FlightRecord> flights, const estimate::ModelValues& values, const InertiaBand& band);

}  // namespace rotorloop::score
