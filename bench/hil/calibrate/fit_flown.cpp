#include "bench/hil/calibrate/fit_flown.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>

#include "host/base/error.hpp"
#include "host/base/least_squares.hpp"
#include "host/base/symmetric_matrix.hpp"
#include "host/vehicle/drag.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::calibrate {
namespace {

constexpr std::size_t kForce = 5;
using ForceParameters = std::array<double, kForce>;
constexpr std::array kForceNames{"k1", "k2", "c_dh", "c_dxy", "c_dz"};
constexpr ForceParameters kScale{3e-6, 1e-4, 0.02, 0.01, 0.01};  // sizes of 5-inch vehicles: unknowns of order one

ForceParameters in_units(const std::vector<double>& x) {
  ForceParameters out{};
  for (std::size_t k = 0; k < kForce; ++k) out[k] = kScale[k] * x[k];
  return out;
}

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

// Least squares of the force error; no drag coefficient below zero.
LeastSquaresFit fit_forces(const std::vector<LoadPoint>& points, const host::VehicleModel& geometry) {
  const std::array start{geometry.thrust.k1_N_s2, geometry.thrust.k2_N_s2_m, geometry.drag.c_dh_s_m, geometry.drag.c_dxy_N_s2_m2,
                         geometry.drag.c_dz_N_s2_m2};
  std::vector<BoundedParameter> parameters;
  for (std::size_t k = 0; k < kForce; ++k) {
    constexpr double kFree = std::numeric_limits<double>::infinity();
    parameters.push_back({kForceNames[k], "1", start[k] / kScale[k], k < 2 ? -kFree : 0.0, kFree, 1e-5});
  }
  const auto residuals = [&](const std::vector<double>& x) {
    Eigen::Matrix3Xd r(3, points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      r.col(static_cast<Eigen::Index>(i)) = force_N(in_units(x), points[i], geometry.thrust) - points[i].force_B_N;
    return Eigen::VectorXd(r.reshaped());
  };
  const LeastSquaresFit fit = fit_least_squares(parameters, residuals, {.tolerance = 1e-14});
  const SymmetricEigen eigen = symmetric_eigen(fit.information);
  if (!(eigen.values[0] > 1e-9 * eigen.values[kForce - 1])) {
    Eigen::Index worst = 0;
    eigen.vectors.col(0).cwiseAbs().maxCoeff(&worst);
    throw Error(
        {"flown states", fmt::format("leave {} unobservable beside the other coefficients", kForceNames[static_cast<std::size_t>(worst)]),
         "flights of one kind only", "add flights with vertical and horizontal speed"},
        ExitCode::data_quality);
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
  const LeastSquaresFit forces = fit_forces(points, geometry);
  const ForceParameters p = in_units(forces.values);
  FlownFit fit;
  fit.states = points.size();
  const auto value = [&](std::size_t k) { return FittedValue{p[k], forces.at_bound[k] ? 0.0 : kScale[k] * forces.standard_errors[k]}; };
  fit.k1_N_s2 = value(0);
  fit.k2_N_s2_m = value(1);
  fit.c_dh_s_m = value(2);
  fit.c_dxy_N_s2_m2 = value(3);
  fit.c_dz_N_s2_m2 = value(4);
  fit.k1_k2_covariance = kScale[0] * kScale[1] * forces.covariance(0, 1);

  // Eq. (3) with arms from the geometric centre; the rest of the torque is the centre of mass times total thrust.
  Slope yaw, com_x, com_y;
  double xy = 0.0, z = 0.0;
  for (const LoadPoint& at : points) {
    const std::array<double, 4> thrust = thrusts_N(p, at, geometry.thrust);
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
    const Eigen::Vector3d error = at.force_B_N - force_N(p, at, geometry.thrust);
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
