// A flight controller mounted by eye: gyro and accelerometer sit in axes of their own, R(φ)ᵀ of the body's.
#include <cmath>

#include "host/base/elementary.hpp"
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

constexpr EffectOption kTurnOptions[] = {{"roll_rad", "rad", -0.3, 0.3, 0.0}, {"yaw_rad", "rad", -0.3, 0.3, 0.0}};

// Rodrigues' formula.
Eigen::Matrix3d rotation(const Eigen::Vector3d& turn_rad) {
  const double angle = std::sqrt(turn_rad.squaredNorm());
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  const Eigen::Vector3d n = turn_rad / angle;
  Eigen::Matrix3d cross;
  cross << 0.0, -n.z(), n.y(), n.z(), 0.0, -n.x(), -n.y(), n.x(), 0.0;
  const SinCos a = sincos_exact(angle);
  return Eigen::Matrix3d::Identity() + a.sin * cross + (1.0 - a.cos) * cross * cross;
}

void imu_rotation(const EffectValues& v, PlantSetup& setup) {
  const double pitch_rad = v[0], roll_rad = v[1], yaw_rad = v[2];
  const Eigen::Matrix3d to_imu = rotation({roll_rad, pitch_rad, yaw_rad}).transpose();
  setup.imu.gyro_gain = to_imu * setup.imu.gyro_gain;
  setup.imu.accel_gain = to_imu * setup.imu.accel_gain;
}

}  // namespace

const EffectInfo kImuRotation{
    .id = "imu_rotation", .parameter = {"pitch_rad", "rad", -0.3, 0.3, 0.0}, .options = kTurnOptions, .make = effect_of<imu_rotation>};

}  // namespace rotorloop::sim
