// A flight log of a vehicle that obeys the paper's equations 1 to 8 and nothing else, with the truth beside it: what an estimate
// must return within its own uncertainty. White process noise enters at every fine step; motors follow with a first-order lag.
// Conditions of the defaults: 20 s, pose 200 Hz with 2 mm and 2 mrad, rotor speeds 1 kHz without noise, q_a 0.03 m/s²/√Hz,
// q_α 0.3 rad/s²/√Hz, lag 30 ms.
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "bench/sysid/log/flight_record.hpp"
#include "test/support/model_true_pilot.hpp"

namespace rotorloop::model_true {

struct FlightSettings {
  Manoeuvre manoeuvre = Manoeuvre::vertical;
  Path path = {};  // flown instead, when there is one
  std::uint64_t seed = 1;
  double duration_s = 20.0;
  int steps_per_ms = 4;  // fine step 0.25 ms
  double motor_lag_s = 0.030;
  double q_a_m_s2_rtHz = 0.03;       // white acceleration in every axis, density
  double q_alpha_rad_s2_rtHz = 0.3;  // white angular acceleration about every axis, density
  int pose_every_ms = 5;
  double pose_sigma_m = 0.002;    // white, per axis
  double pose_sigma_rad = 0.002;  // white, per axis of the sensor
  int rotor_log_every_ms = 1;     // 5: rotor speeds at 200 Hz
  int imu_every_ms = 0;           // 0: no gyro and accelerometer
  // The pilot flies by the logged poses, each an interval old. By the true state instead, rotor speeds would answer to motion that the log
  // does not show: an estimate that takes rotor speeds for given is then biased, as with any loop closed on a sensor that the fit does not
  // use.
  bool pilot_sees_truth = false;
  // Per sample and axis, beside a constant bias. The accelerometer sits in the centre of mass and reads the mean specific force of
  // the interval before it (stamped in its middle), process noise included; the gyro reads the rate at its stamp.
  double gyro_sigma_rad_s = 0.005;
  double accel_sigma_m_s2 = 0.1;
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_m_s2 = Eigen::Vector3d::Zero();
  // A load on a string at the centre of mass, released aside of the vehicle; the pilot does not know of it.
  double load_kg = 0.0, load_length_m = 0.5;
  Eigen::Vector3d load_aside_m = Eigen::Vector3d::Zero();
};

struct ModelTrueFlight {
  log::FlightRecord record;
  Truth truth;
  std::vector<State> states;  // true, at the moment that each pose shows: stamp - truth.pose_delay_s
  double least_through_flow_m_s = std::numeric_limits<double>::infinity();  // smallest v_z + v_ind: > 0 or the equations end
};

// The same settings and truth give the same bits.
ModelTrueFlight fly(const Truth& truth, const FlightSettings& settings);

// The paper's set: vertical, horizontal and rotation flight with seeds that differ; other settings as given.
std::vector<ModelTrueFlight> fly_identification_set(const Truth& truth, FlightSettings settings);

// White noise of density `q` over one step of an axis: the increments it gives to a rate and to the integral of that rate, exact
// (their covariance is q²[[h, h²/2], [h²/2, h³/3]]). `a`, `b`: independent standard normal numbers.
struct NoiseIncrement {
  double rate = 0.0, integral = 0.0;
};
NoiseIncrement white_increment(double q, double step_s, double a, double b);

}  // namespace rotorloop::model_true
