// The force and torque that a fitted model lacks, step by step in body axes, and everything they may depend on.
// `smoothed` is the maximum-likelihood residual under the fit's noise; it is small where the noise is small, and autocorrelated even
// under the right model (Harvey and Koopman 1992). `free` comes from a pass with 100 times the process variance: the readings alone
// shape it, for plots, regressions and spectra. What either looks like when nothing is missing is told by `simulated`: the same pass
// over noise drawn from the fitted figures. `model` is the model's own wrench through the same pass, so that measured (model + free)
// and model can be compared: both have lost the same frequencies.
#pragma once
#include <cstdint>

#include "bench/diagnose/residuals/samples.hpp"
#include "bench/identify/identify.hpp"

namespace rotorloop::diagnose {

// Sums of smoothed residuals that tell how much the likelihood rises with a variance (variance_effects.hpp) or a step of a constant
// load (steps_in_time.hpp). Rows whitened by the fit's noise.
struct WhitenedResiduals {
  std::vector<Eigen::Matrix<float, 12, Eigen::Dynamic>> steps;  // of each sample: first column the flight's, then the simulated ones
  std::vector<Eigen::Matrix<float, 6, Eigen::Dynamic>> poses;   // of each pose; position, then attitude
  std::vector<std::size_t> pose_sample;                         // the sample that a pose belongs to
  std::vector<Eigen::Matrix<double, 6, 1>> pose_by_stamp;       // rows of a pose per second that its stamp is off
  std::vector<double> pose_position_m;                          // deviation assumed for the positions of a pose, mean of three axes
  std::vector<Eigen::Matrix<float, 3, Eigen::Dynamic>> accels;  // of each accelerometer reading that the fit used
  std::vector<std::size_t> accel_sample;
  std::vector<Eigen::Vector3d> accel_m_s2;  // deviation assumed
};

// What acts at a sample, for directions of loads.
struct SampleState {
  estimate::BodyState x;
  std::array<double, 4> omega_rad_s{}, thrust_N{};
  std::array<double, 4> yaw_by_omega_N_m_s{};  // slope of the torque about z by each rotor's speed
  std::array<Eigen::Vector3d, 4> arm_B_m;      // hub from the centre of mass
  double induced_hover_m_s = 0.0;              // of a rotor that gives a quarter of the thrust at rest
  double mass_kg = 0.0, step_s = 0.0;
  Eigen::Vector3d v_B_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 2> wrench_by_wind =
      Eigen::Matrix<double, 6, 2>::Zero();          // of the model, by air moving along world x, y: N s/m, N s
  Eigen::Matrix<double, 12, 6> whitened_by_wrench;  // residual rows of a step by a constant body wrench over it
};

// Readings minus what the fitted states expect, each stream of each flight by itself.
struct TelemetryResidual {
  std::string flight, stream, unit;  // "gyro", "rad/s"
  bool fitted = false;               // the fit used these readings; else they are a witness
  std::vector<double> t_s;
  std::array<std::vector<double>, 3> value;                                                                          // body axes
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), rms = Eigen::Vector3d::Zero(), assumed = Eigen::Vector3d::Zero();  // deviation of the fit
};

struct ResidualSeries {
  Samples samples;  // one for each step between linked knots, at its middle
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
