#include "bench/calibrate/fit_flown.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "host/base/error.hpp"
#include "host/vehicle/drag.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::calibrate {
namespace {

constexpr Eigen::Index kForce = 5;  // k1, k2, c_dh, c_dxy, c_dz
using ForceParameters = Eigen::Matrix<double, kForce, 1>;
constexpr std::array kForceNames{"k1", "k2", "c_dh", "c_dxy", "c_dz"};

std::array<double, 4> thrusts_N(const ForceParameters& p, const LoadPoint& at, host::ThrustModel m) {
  m.k1_N_s2 = p[0];
  m.k2_N_s2_m = p[1];
  std::array<double, 4> out{};
  for (std::size_t i = 0; i < 4; ++i)
    out[i] = host::solve_thrust(m, at.omega_rad_s[i], at.v_B_m_s.z(), at.v_B_m_s.head<2>().norm()).thrust_N;
  return out;
}

Eigen::Vector3d force_N(const ForceParameters& p, const LoadPoint& at, const host::ThrustModel& m) {
  double sum = 0.0;
  for (const double t : thrusts_N(p, at, m)) sum += t;
  const host::DragModel drag{p[2], p[3], p[4]};
  return Eigen::Vector3d(0.0, 0.0, sum) + host::rotor_drag_B_N(drag, sum, at.v_B_m_s) + host::airframe_drag_B_N(drag, at.v_B_m_s);
}

// Gauss-Newton on the force error. A drag coefficient that would go negative is held at 0 from then on.
struct ForceFit {
  ForceParameters p = ForceParameters::Zero();
  Eigen::Matrix<double, kForce, kForce> covariance = Eigen::Matrix<double, kForce, kForce>::Zero();
  std::array<bool, kForce> held{};
};

ForceFit fit_forces(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry) {
  using Matrix = Eigen::Matrix<double, kForce, kForce>;
  ForceFit fit;
  fit.p << geometry.thrust.k1_N_s2, geometry.thrust.k2_N_s2_m, geometry.drag.c_dh_s_m, geometry.drag.c_dxy_N_s2_m2,
      geometry.drag.c_dz_N_s2_m2;
  const ForceParameters scale(3e-6, 1e-4, 0.02, 0.01, 0.01);  // sizes of 5-inch vehicles: unknowns of order one
  const auto n = static_cast<Eigen::Index>(points.size());
  for (int iteration = 0; iteration < 30; ++iteration) {
    Matrix a = Matrix::Zero();
    ForceParameters b = ForceParameters::Zero();
    double rss = 0.0;
    for (const LoadPoint& at : points) {
      const Eigen::Vector3d r = at.force_B_N - force_N(fit.p, at, geometry.thrust);
      Eigen::Matrix<double, 3, kForce> j;
      for (Eigen::Index k = 0; k < kForce; ++k) {
        ForceParameters low = fit.p, high = fit.p;
        low[k] -= 1e-5 * scale[k];
        high[k] += 1e-5 * scale[k];
        j.col(k) = fit.held[static_cast<std::size_t>(k)]
                       ? Eigen::Vector3d::Zero()
                       : Eigen::Vector3d((force_N(high, at, geometry.thrust) - force_N(low, at, geometry.thrust)) / 2e-5);
      }
      a += j.transpose() * j;
      b += j.transpose() * r;
      rss += r.squaredNorm();
    }
    for (std::size_t k = 0; k < kForce; ++k)
      if (const auto i = static_cast<Eigen::Index>(k); fit.held[k]) a(i, i) = 1.0;
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(a);
    if (!(eigen.eigenvalues()[0] > 1e-9 * eigen.eigenvalues()[kForce - 1])) {
      Eigen::Index worst = 0;
      eigen.eigenvectors().col(0).cwiseAbs().maxCoeff(&worst);
      throw Error({"flown states", fmt::format("cannot tell {} from the other coefficients", kForceNames[static_cast<std::size_t>(worst)]),
                   "flights of one kind only", "add flights with vertical and horizontal speed"},
                  ExitCode::data_quality);
    }
    const ForceParameters step = a.ldlt().solve(b);
    fit.p += step.cwiseProduct(scale);
    const Matrix in_units = scale.asDiagonal() * a.inverse() * scale.asDiagonal();
    fit.covariance = in_units * (rss / static_cast<double>(3 * n - kForce));
    bool newly_held = false;
    for (std::size_t k = 2; k < kForce; ++k)
      if (const auto i = static_cast<Eigen::Index>(k); fit.p[i] < 0.0 && !fit.held[k]) {
        fit.p[i] = 0.0;
        fit.held[k] = newly_held = true;
      }
    if (!newly_held && step.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  return fit;
}

// Least squares of y = c x, both summed over the states.
struct Slope {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  std::size_t n = 0;
  void add(double x, double y) {
    xx += x * x;
    xy += x * y;
    yy += y * y;
    ++n;
  }
  double value() const { return xy / xx; }
  double rss() const { return std::max(0.0, yy - xy * xy / xx); }
  FittedValue fitted() const { return {value(), std::sqrt(rss() / (static_cast<double>(n) - 1.0) / xx)}; }
};

}  // namespace

FlownFit fit_flown(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry) {
  if (points.size() < 20)
    throw Error(
        {"flown states", fmt::format("{} states, at least 20 are needed", points.size()), "", "give a longer flight or a shorter period"},
        ExitCode::data_quality);
  const ForceFit forces = fit_forces(points, geometry);
  FlownFit fit;
  fit.states = points.size();
  const auto value = [&](Eigen::Index i) {
    return FittedValue{forces.p[i], std::sqrt(forces.covariance(i, i)) * (forces.held[static_cast<std::size_t>(i)] ? 0.0 : 1.0)};
  };
  fit.k1_N_s2 = value(0);
  fit.k2_N_s2_m = value(1);
  fit.c_dh_s_m = value(2);
  fit.c_dxy_N_s2_m2 = value(3);
  fit.c_dz_N_s2_m2 = value(4);
  fit.k1_k2_covariance = forces.covariance(0, 1);

  // Eq. (3) with arms from the geometric centre; the rest of the torque is the centre of mass times total thrust.
  Slope yaw, com_x, com_y;
  double xy = 0.0, z = 0.0;
  for (const LoadPoint& at : points) {
    const std::array<double, 4> thrust = thrusts_N(forces.p, at, geometry.thrust);
    double sum = 0.0, drag_torque = 0.0;
    Eigen::Vector2d torque = at.torque_B_N_m.head<2>();
    for (std::size_t i = 0; i < 4; ++i) {
      const host::RotorMount& rotor = geometry.rotors[i];
      torque -= thrust[i] * Eigen::Vector2d(rotor.position_m.y(), -rotor.position_m.x());
      drag_torque += rotor.reaction * at.omega_rad_s[i] * at.omega_rad_s[i];
      sum += thrust[i];
    }
    yaw.add(drag_torque, at.torque_B_N_m.z());
    com_x.add(sum, torque.y());   // pitch: +Δx ΣT
    com_y.add(-sum, torque.x());  // roll: -Δy ΣT
    const Eigen::Vector3d error = at.force_B_N - force_N(forces.p, at, geometry.thrust);
    xy += error.head<2>().squaredNorm();
    z += error.z() * error.z();
  }
  if (!(yaw.xx > 0.0))
    throw Error({"flown states", "hold no yaw torque: the rotors always turn in pairs alike", "", "add a flight that turns about z"},
                ExitCode::data_quality);
  const auto n = static_cast<double>(points.size());
  fit.c_q_N_m_s2 = yaw.fitted();
  fit.com_x_m = com_x.fitted();
  fit.com_y_m = com_y.fitted();
  fit.force_xy_rms_N = std::sqrt(xy / n);
  fit.force_z_rms_N = std::sqrt(z / n);
  fit.roll_pitch_rms_N_m = std::sqrt((com_x.rss() + com_y.rss()) / n);
  fit.yaw_rms_N_m = std::sqrt(yaw.rss() / n);
  return fit;
}

}  // namespace rotorloop::calibrate
