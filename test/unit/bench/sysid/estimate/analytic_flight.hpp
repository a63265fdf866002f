// A clean flight made from geometry alone: a path of sines, the attitude and thrust that it needs, the rotor speeds that give them.
// No model of rotorloop is in it, so it can carry injected faults with known time and size into the checks.
#pragma once
#include <cmath>

#include "bench/sysid/log/flight_record.hpp"
#include "host/base/random.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::estimate::testing {

struct AnalyticFlight {
  log::FlightRecord record;
  host::VehicleModel vehicle;
};

class AnalyticPath {
 public:
  explicit AnalyticPath(double phase) : phase_(phase) {}
  Eigen::Vector3d position_m(double t) const {
    return {0.9 * std::sin(1.6 * t + phase_), 0.6 * std::sin(2.1 * t + 2.0 * phase_),
            1.5 + 0.25 * std::sin(3.1 * t) + 0.05 * std::sin(9.0 * t)};
  }
  Eigen::Vector3d velocity_m_s(double t) const { return (position_m(t + kStep_s) - position_m(t - kStep_s)) / (2.0 * kStep_s); }
  // p'' + g: what an accelerometer at the centre of mass shows, in world axes.
  Eigen::Vector3d specific_force_m_s2(double t) const {
    return (position_m(t + kStep_s) - 2.0 * position_m(t) + position_m(t - kStep_s)) / (kStep_s * kStep_s) +
           kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  }
  Eigen::Quaterniond attitude(double t) const {
    const double yaw = 0.3 * std::sin(0.7 * t + phase_);
    const Eigen::Vector3d up = specific_force_m_s2(t).normalized();
    const Eigen::Vector3d left = up.cross(Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0)).normalized();
    Eigen::Matrix3d r;
    r << left.cross(up), left, up;
    return Eigen::Quaterniond(r);
  }
  Eigen::Vector3d rate_rad_s(double t) const {
    Eigen::Quaterniond d = attitude(t - kStep_s).conjugate() * attitude(t + kStep_s);
    if (d.w() < 0.0) d.coeffs() = -d.coeffs();
    return d.vec() / kStep_s;
  }
  Eigen::Vector3d acceleration_rad_s2(double t) const { return (rate_rad_s(t + kStep_s) - rate_rad_s(t - kStep_s)) / (2.0 * kStep_s); }

 private:
  static constexpr double kStep_s = 1e-3;
  double phase_;
};

// 16 s; gyro, accelerometer, rotor speeds and battery at 500 Hz, pose and velocity at 100 Hz, with noise of small real sensors.
inline AnalyticFlight analytic_flight(std::uint64_t seed = 1) {
  AnalyticFlight f;
  host::VehicleModel& v = f.vehicle;
  constexpr double kHalf_m = 0.08, kCt_N_s2 = 1.6e-6, kTorquePerThrust_m = 0.02;
  v.mass_kg = 0.7;
  v.inertia_kg_m2 = {2.0e-3, 2.2e-3, 3.8e-3};
  v.thrust.radius_m = 0.0635;
  v.thrust.air_density_kg_m3 = 1.2;
  v.rotors = {host::RotorMount{{kHalf_m, -kHalf_m, 0.0}, -1}, host::RotorMount{{-kHalf_m, kHalf_m, 0.0}, -1},
              host::RotorMount{{kHalf_m, kHalf_m, 0.0}, 1}, host::RotorMount{{-kHalf_m, -kHalf_m, 0.0}, 1}};
  f.record.name = "analytic";
  const RandomStream random(seed, 41);
  const AnalyticPath path(0.3 * static_cast<double>(seed));
  std::uint64_t drawn = 0;
  const auto draw = [&](double deviation) {
    drawn += 3;
    return Eigen::Vector3d(deviation * random.gaussian(drawn), deviation * random.gaussian(drawn + 1),
                           deviation * random.gaussian(drawn + 2));
  };
  for (int i = 0; i <= 8000; ++i) {
    const double t = 100.0 + 0.002 * i;
    const Eigen::Quaterniond q = path.attitude(t);
    const Eigen::Vector3d w = path.rate_rad_s(t);
    f.record.gyro_B_rad_s.add(t, w + draw(0.01));
    f.record.accel_B_m_s2.add(t, q.conjugate() * path.specific_force_m_s2(t) + draw(0.3));
    const Eigen::Vector3d moment = v.inertia_kg_m2.cwiseProduct(path.acceleration_rad_s2(t)) + w.cross(v.inertia_kg_m2.cwiseProduct(w));
    const double lift = v.mass_kg * path.specific_force_m_s2(t).norm();
    log::RotorValues omega;
    const Eigen::Vector3d a = draw(2.0), b = draw(2.0);
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d& hub = v.rotors[k].position_m;
      const double thrust = 0.25 * (lift + moment.x() * hub.y() / (kHalf_m * kHalf_m) - moment.y() * hub.x() / (kHalf_m * kHalf_m) +
                                    moment.z() * v.rotors[k].reaction / kTorquePerThrust_m);
      omega[k] = std::sqrt(std::max(0.02, thrust) / kCt_N_s2) + (k < 3 ? a[static_cast<int>(k)] : b[0]);
    }
    f.record.rotor_omega_rad_s.add(t, omega);
    f.record.battery_V.add(t, 16.0 - 0.02 * (t - 100.0) + 0.01 * b[1]);
    if (i % 5 == 0) {
      const Eigen::Vector3d tilt = draw(1e-3);
      f.record.pose.add(t, {path.position_m(t) + draw(1e-3), (q * Eigen::Quaterniond(1.0, tilt.x(), tilt.y(), tilt.z())).normalized()});
      f.record.velocity_W_m_s.add(t, path.velocity_m_s(t) + draw(0.01));
    }
  }
  return f;
}

}  // namespace rotorloop::estimate::testing
