// Gyro and accelerometer against the fitted motion: where the fit did not use them they are a witness of their own (a lever arm, a
// bias that follows vibration, a force that the poses are too coarse to show).
#pragma once
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "bench/sysid/estimate/grid_flight.hpp"
#include "bench/sysid/estimate/noise_model.hpp"

namespace rotorloop::diagnose {

// Measurements minus what the fitted states expect, each stream of each flight by itself.
struct TelemetryResidual {
  std::string flight, stream, unit;  // "gyro", "rad/s"
  bool fitted = false;               // the fit used these measurements; else they are a witness
  std::vector<double> t_s;
  std::array<std::vector<double>, 3> value;                                                                          // body axes
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), rms = Eigen::Vector3d::Zero(), assumed = Eigen::Vector3d::Zero();  // deviation of the fit
};

// Gyro and accelerometer against the fitted states: those in the grid, else those of the log when there is one.
void add_telemetry(const estimate::GridFlight& flight, const estimate::ModelValues& values, const estimate::NoiseModel& noise,
                   const std::vector<estimate::BodyState>& states, const log::FlightRecord* log, std::vector<TelemetryResidual>& out);

}  // namespace rotorloop::diagnose
