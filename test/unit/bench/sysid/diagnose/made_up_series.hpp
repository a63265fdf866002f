// Made-up flights for the tests of residual statistics: four of 20 s at 100 Hz, inputs that wander, noise of known size.
#pragma once
#include <cmath>
#include <functional>

#include "bench/sysid/diagnose/residuals/residual_series.hpp"
#include "host/base/random.hpp"

namespace rotorloop::diagnose::testing {

inline constexpr double kStep_s = 0.01;
inline constexpr std::size_t kFlights = 4, kPerFlight = 2000, kAll = kFlights * kPerFlight;

inline Samples four_flights() {
  Samples s;
  for (std::size_t f = 0; f < kFlights; ++f) {
    s.flights.push_back("flight " + std::to_string(f + 1));
    s.add(f, 0.0, kStep_s, kPerFlight);
  }
  return s;
}

inline std::vector<double> white(std::uint64_t module, double deviation = 1.0, std::size_t n = kAll) {
  const RandomStream random(5, module);
  std::vector<double> v;
  for (std::size_t i = 0; i < n; ++i) v.push_back(deviation * random.gaussian(i));
  return v;
}

// First-order noise with correlation time tau, of deviation 1: how speeds and gusts wander.
inline std::vector<double> wandering(std::uint64_t module, double tau_s) {
  const std::vector<double> n = white(module);
  const double keep = std::exp(-kStep_s / tau_s), fresh = std::sqrt(1.0 - keep * keep);
  std::vector<double> v(n.size());
  for (std::size_t i = 0; i < n.size(); ++i) v[i] = i % kPerFlight == 0 ? n[i] : keep * v[i - 1] + fresh * n[i];
  return v;
}

inline std::vector<double> made(const std::function<double(std::size_t)>& f) {
  std::vector<double> v;
  for (std::size_t i = 0; i < kAll; ++i) v.push_back(f(i));
  return v;
}

inline Axes quiet_axes(std::uint64_t module, double deviation = 1.0) {
  Axes a;
  for (std::size_t i = 0; i < kAxes; ++i) a[i] = white(module + i, deviation);
  return a;
}

// Residuals whose states are known exactly, so that whitened rows are white noise: 24 simulated columns.
inline ResidualSeries known_states() {
  constexpr Eigen::Index kSimulated = 24;
  ResidualSeries r;
  r.samples = four_flights();
  const RandomStream random(5, 900);
  std::uint64_t drawn = 0;
  const std::vector<double> speed = wandering(901, 1.0), climb = wandering(902, 2.0);
  for (std::size_t i = 0; i < kAll; ++i) {
    SampleState s;
    s.v_B_m_s = {3.0 * speed[i], 0.0, 6.0 * climb[i]};
    s.x.v_W_m_s = s.v_B_m_s;
    s.omega_rad_s.fill(900.0);
    s.thrust_N.fill(1.7);
    constexpr double kArm_m = 0.09;
    s.arm_B_m = {Eigen::Vector3d(kArm_m, -kArm_m, 0), {-kArm_m, kArm_m, 0}, {kArm_m, kArm_m, 0}, {-kArm_m, -kArm_m, 0}};
    s.induced_hover_m_s = 7.5;
    s.mass_kg = 0.7;
    s.step_s = kStep_s;
    s.wrench_by_wind.topRows<2>() = 0.2 * Eigen::Matrix2d::Identity();  // 0.2 N for each m/s of wind
    s.whitened_by_wrench.setZero();
    s.whitened_by_wrench.block<3, 3>(3, 0) = Eigen::Matrix3d::Identity() * 2.0;    // one step knows a force to half a newton
    s.whitened_by_wrench.block<3, 3>(9, 3) = Eigen::Matrix3d::Identity() * 100.0;  // and a torque to 10 mN m
    r.state.push_back(s);
    Eigen::Matrix<float, 12, Eigen::Dynamic> rows(12, 1 + kSimulated);
    for (Eigen::Index k = 0; k < rows.size(); ++k) rows(k) = static_cast<float>(random.quick_gaussian(drawn++));
    r.whitened.steps.push_back(rows);
    Eigen::Matrix<float, 6, Eigen::Dynamic> pose(6, 1 + kSimulated);
    for (Eigen::Index k = 0; k < pose.size(); ++k) pose(k) = static_cast<float>(random.quick_gaussian(drawn++));
    r.whitened.poses.push_back(pose);
    r.whitened.pose_sample.push_back(i);
    r.whitened.pose_position_m.push_back(2e-3);
    Eigen::Matrix<double, 6, 1> by = Eigen::Matrix<double, 6, 1>::Zero();
    by.head<3>() = s.x.v_W_m_s / 2e-3;
    r.whitened.pose_by_stamp.push_back(by);
  }
  return r;
}

}  // namespace rotorloop::diagnose::testing
