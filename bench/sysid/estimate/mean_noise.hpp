// The noise of several flights as one: what is to be expected of a flight that was not fitted.
#pragma once
#include <span>

#include "bench/sysid/estimate/noise_model.hpp"

namespace rotorloop::estimate {

// Mean variances. At least one flight.
inline NoiseModel mean_noise(std::span<const NoiseModel> flights) {
  NoiseModel out;
  for (auto what : {&NoiseModel::force_m_s2_rtHz, &NoiseModel::angular_rad_s2_rtHz, &NoiseModel::position_m, &NoiseModel::attitude_rad,
                    &NoiseModel::velocity_m_s, &NoiseModel::gyro_rad_s, &NoiseModel::accel_m_s2}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const NoiseModel& n : flights) sum += (n.*what).cwiseAbs2();
    out.*what = (sum / static_cast<double>(flights.size())).cwiseSqrt();
  }
  return out;
}

}  // namespace rotorloop::estimate
