// The force and torque that a fitted model lacks, step by step in body axes, and everything they may depend on.
// `smoothed` is the maximum-likelihood residual under the fit's noise; it is small where the noise is small, and autocorrelated even
// under the right model (Harvey and Koopman 1992). `free` comes from a pass with 100 times the process variance: the measurements alone
// shape it, for plots, regressions and spectra. What either looks like when nothing is missing is in `simulated`: the same pass
// over noise drawn from the fitted figures. `model` is the model's own wrench through the same pass, so that measured (model + free)
// and model can be compared: both have lost the same frequencies.
#pragma once
#include <cstdint>

#include "bench/sysid/diagnose/residuals/sample_state.hpp"
#include "bench/sysid/diagnose/residuals/samples.hpp"
#include "bench/sysid/diagnose/residuals/telemetry.hpp"
#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::diagnose {

// Sums of smoothed residuals that give how much the likelihood rises with a variance (variance_effects.hpp) or a step of a constant
// load (steps_in_time.hpp). Rows whitened by the fit's noise.
struct WhitenedResiduals {
  std::vector<Eigen::Matrix<float, 12, Eigen::Dynamic>> steps;  // of each sample: first column the flight's, then the simulated ones
  std::vector<Eigen::Matrix<float, 6, Eigen::Dynamic>> poses;   // of each pose; position, then attitude
  std::vector<std::size_t> pose_sample;                         // the sample that a pose belongs to
  std::vector<Eigen::Matrix<double, 6, 1>> pose_by_stamp;       // rows of a pose per second that its stamp is off
  std::vector<double> pose_position_m;                          // deviation assumed for the positions of a pose, mean of three axes
  std::vector<Eigen::Matrix<float, 3, Eigen::Dynamic>> accels;  // of each accelerometer measurement that the fit used
  std::vector<std::size_t> accel_sample;
  std::vector<Eigen::Vector3d> accel_m_s2;  // deviation assumed
};

struct ResidualSeries {
  Samples samples;  // one for each step between linked nodes, at its middle
  Axes smoothed, smoothed_u, free, free_u, model;
  std::vector<Axes> simulated;
  std::vector<Channel> inputs;  // what the wrench may depend on
  std::vector<SampleState> state;
  WhitenedResiduals whitened;
  std::vector<TelemetryResidual> telemetry;

  const Channel* input(std::string_view id) const;
};

struct SeriesOptions {
  int simulated = 32;
  double free_scale = 100.0;
  std::uint64_t seed = 1;
  std::span<const identify::FlightToFit> logs;  // optional, in the order of the flights: gyro and accelerometer that the fit did not use
};

ResidualSeries residual_series(const identify::Identification& result, const SeriesOptions& options = {});

}  // namespace rotorloop::diagnose
