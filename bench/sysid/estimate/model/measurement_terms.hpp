// What a model's terms add to what the sensors read (host/effects, hook `reading`), with derivatives by parameters of terms.
#pragma once
#include <span>
#include <vector>

#include "bench/sysid/estimate/model/body_state.hpp"
#include "bench/sysid/estimate/model/model.hpp"

namespace rotorloop::estimate {

struct MeasurementChange {
  Eigen::Vector3d position_W_m = Eigen::Vector3d::Zero(), velocity_W_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_B_rad = Eigen::Vector3d::Zero();  // the attitude reads q Exp(turn)
  Eigen::Vector3d gyro_B_rad_s = Eigen::Vector3d::Zero(), accel_B_m_s2 = Eigen::Vector3d::Zero();
};

// Whether a term of the list reads at all.
bool has_measurement_terms(const host::TermList& terms);
// Parameters (index as in ModelValues) of the terms that read.
std::vector<int> measurement_parameters(const host::TermList& terms);

// What sensors show at one moment beside the state and the rotors.
struct SensedMoment {
  double t_s = 0.0, since_start_s = 0.0;  // of the log; since its first node
  Eigen::Vector3d angular_acceleration_B_rad_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d specific_force_B_m_s2 = Eigen::Vector3d::Zero();  // at the place of the inertial sensor
};

// F/m + Ω̇ x r + Ω x (Ω x r).
Eigen::Vector3d specific_force_at_imu(const ModelValues& values, const BodyState& x, const Instant& now);
SensedMoment sensed_moment(const Model& model, const BodyState& x, const RotorInputSample& u, double t_s, double since_start_s);

// At one moment. `by`: derivatives by each of `parameters`, which belong to terms of the list; may be empty.
MeasurementChange measurement_change(const ModelValues& values, const BodyState& x, const RotorInputSample& u, const SensedMoment& at,
                                     std::span<const int> parameters, std::span<MeasurementChange> by);

// Its derivatives by the error of the state (p, v, φ, Ω; see Model); angular acceleration, specific force and memory stay.
struct MeasurementSlope {
  Eigen::Matrix<double, 3, 12> position_W_m, velocity_W_m_s, turn_B_rad, gyro_B_rad_s, accel_B_m_s2;
  Eigen::Matrix3d accel_by_specific_force;
};
MeasurementSlope measurement_by_state(const ModelValues& values, const BodyState& x, const RotorInputSample& u, const SensedMoment& at);

}  // namespace rotorloop::estimate
