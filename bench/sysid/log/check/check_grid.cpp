// All streams of a flight on one grid; see check_steps.hpp.
#include <algorithm>
#include <cmath>

#include "bench/sysid/log/check/check_steps.hpp"
#include "bench/sysid/log/check/stream_access.hpp"

namespace rotorloop::log {
namespace {

constexpr double kGridStep_s = 0.0025;

template <class Value>
std::vector<double> smooth(const Stream<Value>& s, std::size_t c, const Grid& g, double corner_hz) {
  return low_pass(on_grid(s.t_s, channel(s, c), g), g.dt_s, corner_hz);
}

std::vector<Eigen::Vector3d> vectors(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& z) {
  std::vector<Eigen::Vector3d> out(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = {x[i], y[i], z[i]};
  return out;
}

template <class Value>
std::vector<Eigen::Vector3d> smooth_vectors(const Stream<Value>& s, const Grid& g, double corner_hz) {
  return vectors(smooth(s, 0, g, corner_hz), smooth(s, 1, g, corner_hz), smooth(s, 2, g, corner_hz));
}

std::vector<Eigen::Vector3d> rates(const std::vector<Eigen::Vector3d>& p, double dt_s) {
  std::vector<double> x(p.size()), y(p.size()), z(p.size());
  for (std::size_t i = 0; i < p.size(); ++i) {
    x[i] = p[i].x();
    y[i] = p[i].y();
    z[i] = p[i].z();
  }
  return vectors(derivative(x, dt_s), derivative(y, dt_s), derivative(z, dt_s));
}

template <class Value>
void require(FlightGrid& g, const Stream<Value>& s) {
  const std::vector<char> c = covered(s.t_s, g.grid, std::max(0.04, 2.5 * period_s(s)));
  for (std::size_t i = 0; i < c.size(); ++i) g.valid[i] = g.valid[i] && c[i];
}

// Attitude by its components: signs continuous, filtered, normalised again. Good to a thousandth below 3 Hz, where checks look.
void add_attitude(FlightGrid& g, const Stream<PoseReading>& pose, const host::VehicleModel& vehicle, double corner_hz) {
  std::vector<double> q[4];
  std::vector<Eigen::Quaterniond> raw(pose.size());
  for (std::size_t i = 0; i < pose.size(); ++i) {
    raw[i] = pose.value[i].q_WS * vehicle.pose_sensor_q_BS.conjugate();
    if (i > 0 && raw[i].dot(raw[i - 1]) < 0.0) raw[i].coeffs() = -raw[i].coeffs();
  }
  for (std::size_t c = 0; c < 4; ++c) {
    std::vector<double> v(raw.size());
    for (std::size_t i = 0; i < raw.size(); ++i) v[i] = raw[i].coeffs()[static_cast<Eigen::Index>(c)];
    q[c] = low_pass(on_grid(pose.t_s, v, g.grid), g.grid.dt_s, corner_hz);
  }
  g.q_WB.resize(g.grid.count);
  for (std::size_t i = 0; i < g.grid.count; ++i) g.q_WB[i] = Eigen::Quaterniond(q[3][i], q[0][i], q[1][i], q[2][i]).normalized();
  g.pose_rate_B_rad_s.assign(g.grid.count, Eigen::Vector3d::Zero());
  for (std::size_t i = 1; i + 1 < g.grid.count; ++i) {
    Eigen::Quaterniond d = g.q_WB[i - 1].conjugate() * g.q_WB[i + 1];
    if (d.w() < 0.0) d.coeffs() = -d.coeffs();
    g.pose_rate_B_rad_s[i] = d.vec() / g.grid.dt_s;  // 2 sin(φ/2) / 2 dt
  }
}

}  // namespace

FlightGrid make_grid(const CheckState& s, double corner_hz) {
  const FlightRecord& r = s.record;
  const host::VehicleModel& vehicle = s.vehicle;
  FlightGrid g;
  TimeRange range{HUGE_VAL, -HUGE_VAL};
  for_each_stream(r, [&](const std::string& name, const auto& stream) {
    if (name != stream_name::battery) range = {std::min(range.from_s, stream.t_s.front()), std::max(range.to_s, stream.t_s.back())};
  });
  g.grid = grid_over(range, kGridStep_s);
  if (g.grid.count < 2) return g;
  g.valid.assign(g.grid.count, 1);
  if (r.pose.size() > 3) {
    g.has_attitude = g.has_position = true;
    require(g, r.pose);
    add_attitude(g, r.pose, vehicle, corner_hz);
    std::vector<Eigen::Vector3d> p = smooth_vectors(r.pose, g.grid, corner_hz);
    for (std::size_t i = 0; i < p.size(); ++i) p[i] -= g.q_WB[i] * vehicle.pose_sensor_p_BS_m;
    g.position_rate_W_m_s = rates(p, g.grid.dt_s);
  }
  if (r.position_W_m.size() > 3 && !g.has_position) {
    g.has_position = true;
    require(g, r.position_W_m);
    g.position_rate_W_m_s = rates(smooth_vectors(r.position_W_m, g.grid, corner_hz), g.grid.dt_s);
  }
  if (g.has_position) g.position_acc_W_m_s2 = rates(g.position_rate_W_m_s, g.grid.dt_s);
  if (r.velocity_W_m_s.size() > 3) {
    g.has_velocity = true;
    require(g, r.velocity_W_m_s);
    g.velocity_W_m_s = smooth_vectors(r.velocity_W_m_s, g.grid, corner_hz);
  }
  if (r.gyro_B_rad_s.size() > 3) {
    g.has_gyro = true;
    require(g, r.gyro_B_rad_s);
    g.gyro_B_rad_s = smooth_vectors(r.gyro_B_rad_s, g.grid, corner_hz);
  }
  if (r.accel_B_m_s2.size() > 3) {
    g.has_accel = true;
    require(g, r.accel_B_m_s2);
    g.accel_B_m_s2 = smooth_vectors(r.accel_B_m_s2, g.grid, corner_hz);
  }
  if (r.rotor_omega_rad_s.size() > 3) {
    g.has_rotors = true;
    require(g, r.rotor_omega_rad_s);
    std::vector<double> w[4];
    for (std::size_t c = 0; c < 4; ++c) w[c] = smooth(r.rotor_omega_rad_s, c, g.grid, corner_hz);
    g.omega_rad_s.resize(g.grid.count);
    for (std::size_t i = 0; i < g.grid.count; ++i) g.omega_rad_s[i] = {w[0][i], w[1][i], w[2][i], w[3][i]};
  }
  for (const TimeRange& u : s.unusable)
    for (std::size_t i = g.grid.nearest(u.from_s); i <= g.grid.nearest(u.to_s); ++i) g.valid[i] = 0;
  g.valid = shrunk(g.valid, g.grid.dt_s, 1.0 / corner_hz);
  return g;
}

FlightRecord turning_streams(const FlightRecord& r) {
  FlightRecord out;
  out.rotor_omega_rad_s = r.rotor_omega_rad_s;
  out.gyro_B_rad_s = r.gyro_B_rad_s;
  if (r.gyro_B_rad_s.size() <= 3) out.pose = r.pose;
  return out;
}

}  // namespace rotorloop::log
