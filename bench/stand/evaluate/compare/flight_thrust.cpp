#include "bench/stand/evaluate/compare/flight_thrust.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/sysid/log/stream_reader.hpp"
#include "host/base/constants.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::stand {
namespace {

constexpr std::size_t kFewestWindows = 5;
constexpr double kTurning_rad = 0.35;  // tilt beyond which a rotor's inflow is none of hover

std::optional<double> covariance_of(const host::VehicleFile& v, const std::string& a, const std::string& b) {
  for (const host::CovarianceBlock& c : v.covariance) {
    const auto i = std::find(c.of.begin(), c.of.end(), a), j = std::find(c.of.begin(), c.of.end(), b);
    if (i != c.of.end() && j != c.of.end())
      return c.matrix[static_cast<std::size_t>(i - c.of.begin()) * c.of.size() + static_cast<std::size_t>(j - c.of.begin())];
  }
  return std::nullopt;
}

struct Window {
  double c_t = 0.0, omega_rad_s = 0.0;
};

// Mean of Σω² and of the pose over a window; nothing where a rotor's speed lacks, or the vehicle does more than hover.
std::optional<Window> window_at(const log::FlightRecord& f, double from_s, const HoverOptions& o) {
  const double to_s = from_s + o.window_s;
  double sum = 0.0, n = 0.0;
  const auto& rotors = f.rotor_omega_rad_s;
  for (auto i = static_cast<std::size_t>(std::lower_bound(rotors.t_s.begin(), rotors.t_s.end(), from_s) - rotors.t_s.begin());
       i < rotors.size() && rotors.t_s[i] < to_s; ++i) {
    double squares = 0.0;
    for (const double w : rotors.value[i]) squares += w * w;
    if (squares == squares) {
      sum += squares;
      n += 1.0;
    }
  }
  if (n < 10.0) return std::nullopt;
  // Height by a parabola over the window: its curvature is the mean acceleration.
  double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0, s4 = 0.0, z0 = 0.0, z1 = 0.0, z2 = 0.0, upright = 0.0;
  const auto& pose = f.pose;
  Eigen::Vector3d first, last;
  for (auto i = static_cast<std::size_t>(std::lower_bound(pose.t_s.begin(), pose.t_s.end(), from_s) - pose.t_s.begin());
       i < pose.size() && pose.t_s[i] < to_s; ++i) {
    const double t = pose.t_s[i] - from_s - 0.5 * o.window_s, z = pose.value[i].p_W_m.z();
    if (s0 == 0.0) first = pose.value[i].p_W_m;
    last = pose.value[i].p_W_m;
    s0 += 1.0;
    s1 += t;
    s2 += t * t;
    s3 += t * t * t;
    s4 += t * t * t * t;
    z0 += z;
    z1 += z * t;
    z2 += z * t * t;
    upright += (pose.value[i].q_WS * Eigen::Vector3d::UnitZ()).z();
  }
  if (s0 < 20.0) return std::nullopt;
  upright /= s0;
  const double travelled = (last - first).norm();
  if (travelled > o.slowest_m_s * o.window_s || upright < std::cos(kTurning_rad)) return std::nullopt;
  const double det = s0 * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2);
  const double curvature = (s0 * (s2 * z2 - s3 * z1) - s1 * (s1 * z2 - s2 * z1) + z0 * (s1 * s3 - s2 * s2)) / det;
  const double squares = sum / n, acceleration = 2.0 * curvature;
  if (std::abs(acceleration) > 1.0) return std::nullopt;
  const double c = o.mass_kg * (kGravity_m_s2 + acceleration) / (upright * squares);
  return Window{c, std::sqrt(0.25 * squares)};
}

}  // namespace

FlightCoefficient flight_coefficient(const host::VehicleFile& v, std::optional<double> correlation) {
  const double rho = v.air_density_kg_m3, q = 2.0 * rho * std::numbers::pi * v.radius_m * v.radius_m;
  const double k1 = v.k1_N_s2.value, k2 = v.k2_N_s2_m.value, s = std::sqrt(k2 * k2 + 4.0 * q * k1), u = (k2 + s) / (2.0 * q);
  const double by_k1 = 2.0 * q * u / s, by_k2 = 2.0 * q * u * u / s;
  const auto cov = covariance_of(v, "thrust_model.k1", "thrust_model.k2");
  const double covariance = correlation ? *correlation * v.k1_N_s2.u * v.k2_N_s2_m.u : cov.value_or(0.0);
  const double variance =
      by_k1 * by_k1 * v.k1_N_s2.u * v.k1_N_s2.u + by_k2 * by_k2 * v.k2_N_s2_m.u * v.k2_N_s2_m.u + 2.0 * by_k1 * by_k2 * covariance;
  FlightCoefficient f;
  f.what = "k1, k2 of " + v.name;
  f.c_t_N_s2 = q * u * u;
  f.u_N_s2 = std::sqrt(std::max(0.0, variance));
  f.air_density_kg_m3 = rho;
  f.omega_rad_s = std::sqrt(v.mass_kg.value * kGravity_m_s2 / (4.0 * f.c_t_N_s2));
  const double r = covariance / (v.k1_N_s2.u * v.k2_N_s2_m.u);
  f.note = correlation ? fmt::format("correlation of k1 and k2 {:.3f}, as given", r)
           : cov       ? fmt::format("correlation of k1 and k2 {:.3f}, of the file's covariance", r)
                       : std::string(
                             "the file has no covariance of k1 and k2: their correlation counts as 0, which makes u too large; "
                                   "--correlation, or "
                                   "the file that identify wrote");
  return f;
}

std::optional<FlightCoefficient> hover_coefficient(const std::vector<log::FlightRecord>& flights, const HoverOptions& o) {
  std::vector<Window> windows;
  for (const log::FlightRecord& f : flights) {
    if (f.pose.empty() || f.rotor_omega_rad_s.empty()) continue;
    for (double t = f.pose.t_s.front(); t + o.window_s < f.pose.t_s.back(); t += o.window_s)
      if (const auto w = window_at(f, t, o)) windows.push_back(*w);
  }
  // On the ground or in a hand the rotors are slow, and the weight over their squares is large: such windows are none of hover.
  double fastest = 0.0;
  for (const Window& w : windows) fastest = std::max(fastest, w.omega_rad_s);
  std::erase_if(windows, [&](const Window& w) { return w.omega_rad_s < 0.75 * fastest; });
  if (windows.size() < kFewestWindows) return std::nullopt;
  const double n = static_cast<double>(windows.size());
  double mean = 0.0, omega = 0.0, squares = 0.0, neighbours = 0.0;
  for (const Window& w : windows) {
    mean += w.c_t / n;
    omega += w.omega_rad_s / n;
  }
  for (std::size_t i = 0; i < windows.size(); ++i) {
    squares += std::pow(windows[i].c_t - mean, 2);
    if (i > 0) neighbours += (windows[i].c_t - mean) * (windows[i - 1].c_t - mean);
  }
  const double r1 = std::clamp(neighbours / squares, 0.0, 0.95), effective = std::max(2.0, n * (1.0 - r1) / (1.0 + r1));
  const double scatter = std::sqrt(squares / (n - 1.0) / effective) / mean;
  FlightCoefficient f;
  f.what = "hover, m g / Σ ω²";
  f.c_t_N_s2 = mean;
  f.air_density_kg_m3 = o.air_density_kg_m3;
  f.omega_rad_s = omega;
  const double mass = o.mass_u_kg / o.mass_kg;
  f.u_N_s2 = mean * std::sqrt(scatter * scatter + mass * mass + 4.0 * o.speed_u * o.speed_u);
  f.note = fmt::format("{} windows of {:g} s: scatter {:.2f} %, mass {:.2f} %, rotor speed {:.2f} %", windows.size(), o.window_s,
                       100.0 * scatter, 100.0 * mass, 200.0 * o.speed_u);
  return f;
}

}  // namespace rotorloop::stand
