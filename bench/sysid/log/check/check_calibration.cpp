// Gyro and accelerometer against what the poses say of the same motion, axis by axis: a scale or a turn of the IMU needs no model of the
// vehicle to be seen. Noted, not refused: the fit has terms for both (host/effects/sensors.hpp).
#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bench/sysid/log/check/check_steps.hpp"
#include "host/base/constants.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::log {
namespace {

constexpr double kCalibrationCorner_hz = 4.0;
constexpr std::size_t kTenths = 10;  // of the flight, left out one at a time for the uncertainty
constexpr double kFewestU = 3.3;
constexpr double kScaleMatters = 0.005;  // data sheets promise 1 %
constexpr double kTurnMatters_rad = 0.5 / kDeg_per_rad;

// y = A x + b from sums over samples of (x, 1).
struct LinearSums {
  Eigen::Matrix4d xx = Eigen::Matrix4d::Zero();
  Eigen::Matrix<double, 4, 3> xy = Eigen::Matrix<double, 4, 3>::Zero();
  void add(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
    const Eigen::Vector4d row(x.x(), x.y(), x.z(), 1.0);
    xx += row * row.transpose();
    xy += row * y.transpose();
  }
  Eigen::Matrix3d gain() const {
    const Eigen::Matrix4d ridge = 1e-9 * xx.diagonal().maxCoeff() * Eigen::Matrix4d::Identity();
    return LdltFactor(xx + ridge).solve(Eigen::MatrixXd(xy)).topRows(3).transpose();
  }
};
using Parts = std::array<LinearSums, kTenths>;

// Three numbers of a gain matrix with their uncertainties: that of leaving out a tenth of the flight at a time.
struct Three {
  Eigen::Vector3d value = Eigen::Vector3d::Zero(), u = Eigen::Vector3d::Zero();
};
template <class Read>
Three jackknifed(const Parts& parts, Read&& read) {
  LinearSums all;
  for (const LinearSums& p : parts) {
    all.xx += p.xx;
    all.xy += p.xy;
  }
  std::array<Eigen::Vector3d, kTenths> without;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < kTenths; ++i) {
    LinearSums rest = all;
    rest.xx -= parts[i].xx;
    rest.xy -= parts[i].xy;
    without[i] = read(rest.gain());
    mean += without[i] / static_cast<double>(kTenths);
  }
  for (const Eigen::Vector3d& w : without) square += (w - mean).cwiseAbs2();
  const double factor = static_cast<double>(kTenths - 1) / static_cast<double>(kTenths);
  return {read(all.gain()), (factor * square).cwiseSqrt()};
}

// What the poses say `late_s` later, at grid point i; between points linearly.
std::optional<Eigen::Vector3d> shifted(const FlightGrid& g, const std::vector<Eigen::Vector3d>& v, std::size_t i, double late_s) {
  const double at = static_cast<double>(i) + late_s / g.grid.dt_s, whole = std::floor(at), share = at - whole;
  if (whole < 0.0 || whole + 1.0 >= static_cast<double>(v.size())) return std::nullopt;
  const auto k = static_cast<std::size_t>(whole);
  if (!g.valid[k] || !g.valid[k + 1]) return std::nullopt;
  return (1.0 - share) * v[k] + share * v[k + 1];
}

template <class X, class Y>
Parts sums(const FlightGrid& g, double late_s, const std::vector<Eigen::Vector3d>& of_pose, X&& x, Y&& y) {
  Parts out;
  for (std::size_t i = 0; i < g.grid.count; i += 2) {
    if (!g.valid[i]) continue;
    if (const auto pose = shifted(g, of_pose, i, late_s)) out[i * kTenths / g.grid.count].add(x(i, *pose), y(i, *pose));
  }
  return out;
}

bool stands_out(const Three& t, double neutral, double matters) {
  const Eigen::Array3d off = (t.value.array() - neutral).abs();
  return (off > matters && off > kFewestU * t.u.array()).any();
}

std::string three(const Three& t, double factor, const char* unit) {
  return fmt::format("{:.2f}, {:.2f}, {:.2f} {} (u {:.2f}, {:.2f}, {:.2f})", factor * t.value.x(), factor * t.value.y(),
                     factor * t.value.z(), unit, factor * t.u.x(), factor * t.u.y(), factor * t.u.z());
}

// Rates of the body by attitudes next to each other, then low-passed as the gyro is: filtering attitudes instead loses some of a fast turn.
std::vector<Eigen::Vector3d> rates_of_pose(const CheckState& s, const FlightGrid& g) {
  const Stream<PoseReading>& pose = s.record.pose;
  const Eigen::Quaterniond& q_BS = s.vehicle.pose_sensor_q_BS;
  std::vector<double> t, rate[3];
  for (std::size_t i = 1; i < pose.size(); ++i) {
    const double step_s = pose.t_s[i] - pose.t_s[i - 1];
    Eigen::Quaterniond d = pose.value[i - 1].q_WS.conjugate() * pose.value[i].q_WS;
    if (d.w() < 0.0) d.coeffs() = -d.coeffs();
    const Eigen::Vector3d w = q_BS * (2.0 / step_s * d.vec());
    t.push_back(0.5 * (pose.t_s[i] + pose.t_s[i - 1]));
    for (Eigen::Index k = 0; k < 3; ++k) rate[k].push_back(w[k]);
  }
  std::vector<Eigen::Vector3d> out(g.grid.count);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const std::vector<double> smooth = low_pass(on_grid(t, rate[k], g.grid), g.grid.dt_s, kCalibrationCorner_hz);
    for (std::size_t i = 0; i < out.size(); ++i) out[i][k] = smooth[i];
  }
  return out;
}

// gyro = S R rate + b. The rate of the pose is the noisier one, so it is the one regressed: rate = A gyro + c, and S R = A⁻¹. Rows of R
// have length 1, so the rows of S R have that of the scales.
void check_gyro(CheckState& s, const FlightGrid& g, double late_s) {
  const Parts parts = sums(
      g, late_s, rates_of_pose(s, g), [&](std::size_t i, const Eigen::Vector3d&) { return g.gyro_B_rad_s[i]; },
      [](std::size_t, const Eigen::Vector3d& rate) { return rate; });
  const Three scale = jackknifed(
      parts, [](const Eigen::Matrix3d& a) { return Eigen::Vector3d(Eigen::Matrix3d(a.inverse()).rowwise().norm().array() - 1.0); });
  const Three turn = jackknifed(parts, [](const Eigen::Matrix3d& a) {
    const Eigen::Matrix3d r = Eigen::Matrix3d(a.inverse()).rowwise().normalized();  // R(φ)ᵀ = 1 - [φ]x for small angles
    return Eigen::Vector3d(0.5 * Eigen::Vector3d(r(1, 2) - r(2, 1), r(2, 0) - r(0, 2), r(0, 1) - r(1, 0)));
  });
  if (stands_out(scale, 0.0, kScaleMatters))
    s.note(stream_name::gyro,
           fmt::format("reads {} more than the rate of the pose about x, y, z: its scale, or a pose that is smoothed",
                       three(scale, 100.0, "%")),
           s.span());
  if (stands_out(turn, 0.0, kTurnMatters_rad))
    s.note(
        stream_name::gyro,
        fmt::format("stands turned by {} about x, y, z against the body axes of the pose: the IMU, or the pose sensor's quaternion of the "
                    "vehicle file",
                    three(turn, kDeg_per_rad, "deg")),
        s.span());
}

// accel = S R f + b with f = R_WBᵀ (a + g) by the poses: thrust varies along z, so that column of S R is what a flight shows. The poses'
// acceleration has errors, which may be larger than what thrust varies by: they make that gain too small. So a gain above 1 is told, and
// one below 1 only where the inverse of that of f on accel, which these errors scatter but do not move, is below 1 too.
void check_accelerometer(CheckState& s, const FlightGrid& g, double late_s) {
  const Eigen::Vector3d gravity = kGravity_m_s2 * Eigen::Vector3d::UnitZ();
  std::vector<Eigen::Vector3d> force(g.grid.count);
  for (std::size_t i = 0; i < force.size(); ++i) force[i] = g.q_WB[i].conjugate() * (g.position_acc_W_m_s2[i] + gravity);
  const auto by_pose = [](std::size_t, const Eigen::Vector3d& f) { return f; };
  const auto along_z = [&](std::size_t i, const Eigen::Vector3d&) { return Eigen::Vector3d(0.0, 0.0, g.accel_B_m_s2[i].z()); };
  const Three gain = jackknifed(sums(g, late_s, force, by_pose, [&](std::size_t i, const Eigen::Vector3d&) { return g.accel_B_m_s2[i]; }),
                                [](const Eigen::Matrix3d& a) { return Eigen::Vector3d(0.0, 0.0, a.col(2).norm() - 1.0); });
  const Three inverse = jackknifed(sums(g, late_s, force, along_z, by_pose),
                                   [](const Eigen::Matrix3d& a) { return Eigen::Vector3d(0.0, 0.0, 1.0 / a(2, 2) - 1.0); });
  const Three& z = gain.value.z() > 0.0 ? gain : inverse;
  const double off = std::fabs(z.value.z());
  if (gain.value.z() * z.value.z() > 0.0 && off > kScaleMatters && off > kFewestU * z.u.z())
    s.note(
        stream_name::accel,
        fmt::format("changes by {:+.2f} % (u {:.2f}) more than the poses' acceleration and gravity along z: its scale, or vibration that "
                    "it rectifies",
                    100.0 * z.value.z(), 100.0 * z.u.z()),
        s.span());
}

}  // namespace

void check_calibration(CheckState& s) {
  const FlightGrid g = make_grid(s, kCalibrationCorner_hz);
  if (!g.has_attitude || g.grid.count < 400) return;
  const StreamOffset* turning = s.result.offsets.find(stream_name::pose, stream_name::gyro);
  const StreamOffset* moving = s.result.offsets.find(stream_name::pose, stream_name::accel);
  if (g.has_gyro && turning) check_gyro(s, g, turning->late_s);
  if (g.has_accel && (moving || turning)) check_accelerometer(s, g, (turning ? turning : moving)->late_s);
}

}  // namespace rotorloop::log
