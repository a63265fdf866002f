#include "test/support/force_score.hpp"

#include <cmath>
#include <functional>

#include "bench/sysid/estimate/model/model.hpp"
#include "bench/sysid/estimate/model/rotor_input.hpp"
#include "bench/sysid/log/stream_reader.hpp"
#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

using Eigen::Vector3d;

struct Sums {
  std::size_t n = 0;
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  void add(const Vector3d& e) {
    ++n;
    sum += e;
    squares += e.cwiseAbs2();
  }
  ForceScore score(const std::string& name) const {
    ForceScore s{name, n, 0.0, Vector3d::Zero(), Vector3d::Zero()};
    if (n == 0) return s;
    const double per = 1.0 / static_cast<double>(n);
    s.rms_N = std::sqrt(squares.sum() * per);
    s.axis_rms_N = (squares * per).cwiseSqrt();
    s.mean_N = sum * per;
    return s;
  }
};

void need(bool present, const log::FlightRecord& record, const char* stream) {
  if (present) return;
  throw Error({record.source, std::string("no ") + stream + " in flight " + record.name + ": the force cannot be scored without it", "",
               "score the prediction of the motion instead, or map the column"},
              ExitCode::data_quality);
}

// Rates about the accelerometer's sample, and their slope from the gyro's measurements on both sides.
Vector3d slope(log::StreamReader<Vector3d>& gyro_before, log::StreamReader<Vector3d>& gyro_after, double t_s) {
  constexpr double kHalf_s = 5e-3;
  return (gyro_after.at(t_s + kHalf_s) - gyro_before.at(t_s - kHalf_s)) / (2.0 * kHalf_s);
}

// Calls `act(t, state, measured force)` for every usable accelerometer sample.
void each_sample(const log::FlightRecord& record, const estimate::ModelValues& values,
                 const std::function<void(double, const estimate::BodyState&, const Vector3d&)>& act) {
  need(!record.accel_B_m_s2.empty(), record, "accelerometer");
  need(!record.pose.empty(), record, "pose");
  need(!record.velocity_W_m_s.empty(), record, "velocity");
  need(!record.gyro_B_rad_s.empty(), record, "gyro");
  log::StreamReader<log::PoseReading> pose(record.pose);
  log::StreamReader<Vector3d> velocity(record.velocity_W_m_s), gyro(record.gyro_B_rad_s), before(record.gyro_B_rad_s),
      after(record.gyro_B_rad_s);
  const Vector3d gyro_bias(values[estimate::kGyroBiasX], values[estimate::kGyroBiasY], values[estimate::kGyroBiasZ]);
  const Vector3d accel_bias(values[estimate::kAccelBiasX], values[estimate::kAccelBiasY], values[estimate::kAccelBiasZ]);
  const Vector3d imu(values[estimate::kImuX], values[estimate::kImuY], values[estimate::kImuZ]),
      sensor(values[estimate::kOffsetX], values[estimate::kOffsetY], values[estimate::kOffsetZ]);
  const Eigen::Quaterniond q_SB = values.q_BS().conjugate();
  for (std::size_t k = 0; k < record.accel_B_m_s2.size(); ++k) {
    const double t = record.accel_B_m_s2.t_s[k];
    if (!pose.covers(t) || !velocity.covers(t) || !gyro.covers(t)) continue;
    const log::PoseReading at = pose.at(t);
    estimate::BodyState x;
    x.q_WB = at.q_WS * q_SB;
    x.p_W_m = at.p_W_m - x.q_WB * sensor;
    x.w_B_rad_s = gyro.at(t) - gyro_bias;
    x.v_W_m_s = velocity.at(t) - x.q_WB * x.w_B_rad_s.cross(sensor);
    const Vector3d from_place =
        slope(before, after, t).cross(imu) + x.w_B_rad_s.cross(x.w_B_rad_s.cross(imu));  // its own motion about the centre of mass
    act(t, x, values[estimate::kMass] * (record.accel_B_m_s2.value[k] - accel_bias - from_place));
  }
}

}  // namespace

ForceScore score_force(const log::FlightRecord& record, const estimate::ModelValues& values) {
  const estimate::Model model(values);
  estimate::RotorInput input(record);
  input.prepare(values);
  std::size_t hint = 0;
  Sums sums;
  each_sample(record, values, [&](double t, const estimate::BodyState& x, const Vector3d& measured_N) {
    if (!input.covers(t, t)) return;
    sums.add(model.instant(x, input.at(t, hint, false), t).force_B_N - measured_N);
  });
  return sums.score(record.name);
}

std::optional<ForceScore> score_logged_force(const log::FlightRecord& record, const estimate::ModelValues& values,
                                             const std::string& prefix) {
  const auto find = [&](const char* axis) { return record.extra.find(prefix + axis + "[N]"); };
  const auto x = find("x"), y = find("y"), z = find("z");
  if (x == record.extra.end() || y == record.extra.end() || z == record.extra.end()) return std::nullopt;
  log::StreamReader<double> fx(x->second), fy(y->second), fz(z->second);
  Sums sums;
  each_sample(record, values, [&](double t, const estimate::BodyState&, const Vector3d& measured_N) {
    if (fx.covers(t)) sums.add(Vector3d(fx.at(t), fy.at(t), fz.at(t)) - measured_N);
  });
  return sums.score(record.name);
}

ForceScore pooled(std::span<const ForceScore> scores) {
  Sums sums;
  for (const ForceScore& s : scores) {
    const auto n = static_cast<double>(s.samples);
    sums.n += s.samples;
    sums.sum += n * s.mean_N;
    sums.squares += n * s.axis_rms_N.cwiseAbs2();
  }
  return sums.score("pooled");
}

}  // namespace rotorloop::score
