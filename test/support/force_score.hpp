// How far a model's force is from the measured one, sample by sample, with the state taken from the log itself and no estimator
// between: the score in which flights with velocity, attitude, rates and specific force (NeuroBEM and others) are published. Also
// for a prediction that came with the log, so that both stand in one table.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "bench/sysid/estimate/model/parameters.hpp"
#include "bench/sysid/log/flight_record.hpp"

namespace rotorloop::score {

struct ForceScore {
  std::string flight;
  std::size_t samples = 0;
  double rms_N = 0.0;                                                                      // of the error's length
  Eigen::Vector3d axis_rms_N = Eigen::Vector3d::Zero(), mean_N = Eigen::Vector3d::Zero();  // body axes; model minus measured
};

// At each accelerometer measurement between the first and last of the other streams, those interpolated. Measured force = mass times
// specific force, less the accelerometer's bias and brought from its place to the centre of mass, all as in `values`. Throws Error
// (data_quality) naming the stream that the log lacks.
ForceScore score_force(const log::FlightRecord& record, const estimate::ModelValues& values);

// The prediction in the log's extra streams `prefix`x[N], `prefix`y[N], `prefix`z[N]; nothing when it has none.
std::optional<ForceScore> score_logged_force(const log::FlightRecord& record, const estimate::ModelValues& values,
                                             const std::string& prefix);

// All samples in one pot.
ForceScore pooled(std::span<const ForceScore> scores);

}  // namespace rotorloop::score
