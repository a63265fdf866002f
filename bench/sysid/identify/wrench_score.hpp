// How much of the force and torque that a flight's accelerometer and gyro show a model predicts, axis by axis: the score for flights
// that had no part in the fit, beside errors of the motion (held_out.hpp). A torque that the model lacks about one axis shows here by
// itself, where a prediction of the motion mixes all of them.
// Reference: mass times specific force, inertia times angular acceleration (slope of the gyro). Mass and inertia are those that the
// vehicle file has, the same for every model: an error is theirs times that of the acceleration.
#pragma once
#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::identify {

// Both sides go through the same zero-phase filters. Above some 10 Hz the slope of a small gyro is noise; below 1 Hz accelerometers show
// their bias.
struct WrenchBand {
  double from_Hz = 0.0, to_Hz = 10.0;  // 0: no limit on that side
};

using WrenchAxes = Eigen::Matrix<double, 6, 1>;  // force x, y, z (N), torque x, y, z (N m), body axes

struct WrenchScore {
  std::string flight;
  std::size_t samples = 0;
  double delay_s = 0.0;  // by which the measurements were taken later than the model
  WrenchAxes rms = WrenchAxes::Zero();
  WrenchAxes explained = WrenchAxes::Zero();  // R²: 1 - error² / variance of the reference; below 0: worse than its mean

  double force_N() const { return rms.head<3>().norm(); }
  double torque_N_m() const { return rms.tail<3>().norm(); }
};

struct WrenchComparison {
  WrenchBand band;
  bool force = false, torque = false;                // the logs have an accelerometer, a gyro
  std::vector<WrenchScore> before = {}, after = {};  // each flight, then all in one pot ("pooled"); stamps as the fit leaves them
  // The same with the measurements moved by the delay at which the model explains most torque, for each flight and model by itself: what
  // streams are off against each other in a log belongs to that log and says nothing of the vehicle.
  std::vector<WrenchScore> before_aligned = {}, after_aligned = {};
};

// States come from the measurements (flight_motion.hpp), at the fit's rate or 100 Hz, whichever is more. Nothing is scored within a quarter
// of a second of a cut. Flights without accelerometer and gyro are left out; no flight left: the comparison is empty.
WrenchComparison score_wrenches(const std::vector<FlightToFit>& flights, const Identification& before, const Identification& after,
                                const estimate::GridOptions& grid, const WrenchBand& band);

nlohmann::ordered_json wrench_json(const WrenchComparison& scores);  // for result.json

}  // namespace rotorloop::identify
