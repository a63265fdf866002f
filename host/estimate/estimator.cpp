#include "host/estimate/estimator.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"

namespace rotorloop::host {

namespace {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Error = Eigen::Matrix<double, 15, 1>;

// Where each part of the error state starts.
enum Part : int { kP = 0, kV = 3, kA = 6, kGyroBias = 9, kAccelBias = 12 };

constexpr double kMicro = 1e-6;
Vector3 gravity_W_m_s2() { return {0.0, 0.0, -kGravity_m_s2}; }

Matrix3 cross_matrix(const Vector3& v) {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Rotation by the vector `angle`; the series is exact to rounding where it is used.
Eigen::Quaterniond rotation(const Vector3& angle_rad) {
  const double t2 = angle_rad.squaredNorm();
  if (t2 < 0.01) {
    const double s = 0.5 - t2 * (1.0 / 48.0 - t2 * (1.0 / 3840.0 - t2 / 645120.0));
    const double c = 1.0 - t2 * (1.0 / 8.0 - t2 * (1.0 / 384.0 - t2 / 46080.0));
    return {c, s * angle_rad.x(), s * angle_rad.y(), s * angle_rad.z()};
  }
  const double t = std::sqrt(t2);
  const SinCos half = sincos_exact(0.5 * t);
  return {half.cos, half.sin / t * angle_rad.x(), half.sin / t * angle_rad.y(), half.sin / t * angle_rad.z()};
}

// Small-angle vector of q, the short way round.
Vector3 small_angle(const Eigen::Quaterniond& q) { return (q.w() < 0.0 ? -2.0 : 2.0) * q.vec(); }

bool finite(const ImuSample& s) { return s.gyro_B_rad_s.allFinite() && s.accel_B_m_s2.allFinite(); }
bool finite(const PoseSample& s) {
  return s.p_W_m.allFinite() && s.v_W_m_s.allFinite() && s.q_WS.coeffs().allFinite() && std::fabs(s.q_WS.squaredNorm() - 1.0) < 0.1;
}

constexpr double square(double x) { return x * x; }

// One vector measurement r = H dx + noise, with H made of up to three 3×3 blocks.
struct Measurement {
  Vector3 residual;
  std::array<Part, 3> part{};
  std::array<Matrix3, 3> block;
  int blocks = 0;
  double variance = 0.0;
  void add(Part p, const Matrix3& m) {
    part[static_cast<std::size_t>(blocks)] = p;
    block[static_cast<std::size_t>(blocks++)] = m;
  }
};

using PHt = Eigen::Matrix<double, 15, 3>;

PHt gain_numerator(const Eigen::Matrix<double, 15, 15>& P, const Measurement& m) {
  PHt out = PHt::Zero();
  for (int i = 0; i < m.blocks; ++i) {
    const auto b = static_cast<std::size_t>(i);
    out.noalias() += P.middleCols<3>(m.part[b]).lazyProduct(m.block[b].transpose());
  }
  return out;
}

template <class X>
Matrix3 times_h(const Measurement& m, const X& x) {
  Matrix3 out = Matrix3::Zero();
  for (int i = 0; i < m.blocks; ++i) {
    const auto b = static_cast<std::size_t>(i);
    out.noalias() += m.block[b].lazyProduct(x.template middleRows<3>(m.part[b]));
  }
  return out;
}

Matrix3 innovation_covariance(const Measurement& m, const PHt& pht) {
  Matrix3 s = times_h(m, pht);
  s.diagonal().array() += m.variance;
  return s;
}

// Kalman update of the covariance by one measurement after the other. Returns the correction of the state.
Error update(Eigen::Matrix<double, 15, 15>& P, const std::array<Measurement, 3>& z) {
  Error dx = Error::Zero();
  for (const Measurement& m : z) {
    const PHt pht = gain_numerator(P, m);
    const PHt gain = pht.lazyProduct(innovation_covariance(m, pht).inverse().eval());
    Vector3 residual = m.residual;
    for (int i = 0; i < m.blocks; ++i) {
      const auto b = static_cast<std::size_t>(i);
      residual -= m.block[b] * dx.segment<3>(m.part[b]);
    }
    dx += gain.lazyProduct(residual);
    P.noalias() -= gain.lazyProduct(pht.transpose());
  }
  for (int i = 0; i < 15; ++i)  // rounding must not make it lopsided
    for (int j = 0; j < i; ++j) P(i, j) = P(j, i) = 0.5 * (P(i, j) + P(j, i));
  return dx;
}

}  // namespace

Estimator::Estimator(const EstimatorConfig& config, const VehicleModel& vehicle)
    : config_(config), p_BS_m_(vehicle.pose_sensor_p_BS_m), q_BS_(vehicle.pose_sensor_q_BS) {}

Eigen::Matrix<double, 15, 1> Estimator::sigma() const { return P_.diagonal().cwiseMax(0.0).cwiseSqrt(); }

const ImuSample& Estimator::imu(std::size_t age) const { return imu_[(imu_newest_ + kImuBuffer - age) % kImuBuffer]; }

ImuSample Estimator::imu_at(std::int64_t time_us) const {
  if (time_us >= imu(0).time_us) return imu(0);
  std::size_t age = 1;
  while (age + 1 < imu_count_ && imu(age).time_us > time_us) ++age;
  const ImuSample &before = imu(age), &after = imu(age - 1);
  const double f = static_cast<double>(time_us - before.time_us) / static_cast<double>(after.time_us - before.time_us);
  ImuSample out;
  out.time_us = time_us;
  out.gyro_B_rad_s = before.gyro_B_rad_s + f * (after.gyro_B_rad_s - before.gyro_B_rad_s);
  out.accel_B_m_s2 = before.accel_B_m_s2 + f * (after.accel_B_m_s2 - before.accel_B_m_s2);
  return out;
}

// Trapezoid over one interval, with the attitude of both ends.
void Estimator::carry(Nominal& s, const ImuSample& from, const ImuSample& to) {
  const double dt = static_cast<double>(to.time_us - s.time_us) * kMicro;
  const Vector3 w = 0.5 * (from.gyro_B_rad_s + to.gyro_B_rad_s) - s.gyro_bias;
  const Eigen::Quaterniond q1 = (s.q * rotation(w * dt)).normalized();
  const Vector3 a0 = s.q * (from.accel_B_m_s2 - s.accel_bias), a1 = q1 * (to.accel_B_m_s2 - s.accel_bias);
  const Vector3 g = gravity_W_m_s2();
  s.p += s.v * dt + (a0 * (1.0 / 3.0) + a1 * (1.0 / 6.0) + 0.5 * g) * (dt * dt);
  s.v += (0.5 * (a0 + a1) + g) * dt;
  s.q = q1;
  s.time_us = to.time_us;
}

// Nominal state sample by sample; the covariance in one step, its transition taken from what the nominal state did.
void Estimator::roll_to(std::int64_t time_us) {
  if (time_us <= horizon_.time_us) return;
  const Nominal start = horizon_;
  ImuSample last = imu_at(start.time_us);
  std::size_t age = imu_count_;
  while (age > 0 && imu(age - 1).time_us <= start.time_us) --age;
  for (; age > 0 && imu(age - 1).time_us < time_us; --age) {
    carry(horizon_, last, imu(age - 1));
    last = imu(age - 1);
  }
  carry(horizon_, last, imu_at(time_us));

  const double dt = static_cast<double>(time_us - start.time_us) * kMicro;
  const Matrix3 R0 = start.q.toRotationMatrix(), R1 = horizon_.q.toRotationMatrix(), R = 0.5 * (R0 + R1);
  const Vector3 g = gravity_W_m_s2();
  const Vector3 dv = horizon_.v - start.v - g * dt;                            // ∫ R a
  const Vector3 dp = horizon_.p - start.p - start.v * dt - 0.5 * dt * dt * g;  // ∬ R a
  const Matrix3 v_a = -cross_matrix(dv) * R0, p_a = -cross_matrix(dp) * R0;
  const Matrix3 a_a = R1.transpose() * R0;
  const Matrix3 v_gb = -0.5 * dt * v_a, p_gb = -(dt / 3.0) * p_a;
  // P <- F P Fᵀ by blocks, rows then columns. In place: each block row only needs rows below it.
  P_.middleRows<3>(kP) += dt * P_.middleRows<3>(kV) + p_a.lazyProduct(P_.middleRows<3>(kA)) +
                          p_gb.lazyProduct(P_.middleRows<3>(kGyroBias)) - (0.5 * dt * dt) * R.lazyProduct(P_.middleRows<3>(kAccelBias));
  P_.middleRows<3>(kV) += v_a.lazyProduct(P_.middleRows<3>(kA)) + v_gb.lazyProduct(P_.middleRows<3>(kGyroBias)) -
                          dt * R.lazyProduct(P_.middleRows<3>(kAccelBias));
  const Eigen::Matrix<double, 3, 15> rows_a = a_a.lazyProduct(P_.middleRows<3>(kA));
  P_.middleRows<3>(kA) = rows_a - dt * P_.middleRows<3>(kGyroBias);
  P_.middleCols<3>(kP) += dt * P_.middleCols<3>(kV) + P_.middleCols<3>(kA).lazyProduct(p_a.transpose()) +
                          P_.middleCols<3>(kGyroBias).lazyProduct(p_gb.transpose()) -
                          (0.5 * dt * dt) * P_.middleCols<3>(kAccelBias).lazyProduct(R.transpose());
  P_.middleCols<3>(kV) += P_.middleCols<3>(kA).lazyProduct(v_a.transpose()) + P_.middleCols<3>(kGyroBias).lazyProduct(v_gb.transpose()) -
                          dt * P_.middleCols<3>(kAccelBias).lazyProduct(R.transpose());
  const Eigen::Matrix<double, 15, 3> cols_a = P_.middleCols<3>(kA).lazyProduct(a_a.transpose());
  P_.middleCols<3>(kA) = cols_a - dt * P_.middleCols<3>(kGyroBias);

  const double accel = square(config_.accel_noise_m_s2_rtHz) * dt, gyro = square(config_.gyro_noise_rad_s_rtHz) * dt;
  const double gyro_walk = square(config_.gyro_bias_walk_rad_s2_rtHz) * dt, accel_walk = square(config_.accel_bias_walk_m_s3_rtHz) * dt;
  for (int i = 0; i < 3; ++i) {
    P_(kP + i, kP + i) += accel * dt * dt / 3.0;
    P_(kP + i, kV + i) += accel * dt / 2.0;
    P_(kV + i, kP + i) += accel * dt / 2.0;
    P_(kV + i, kV + i) += accel;
    P_(kA + i, kA + i) += gyro;
    P_(kGyroBias + i, kGyroBias + i) += gyro_walk;
    P_(kAccelBias + i, kAccelBias + i) += accel_walk;
  }
}

void Estimator::refresh_now() {
  now_ = horizon_;
  std::size_t age = imu_count_;
  while (age > 0 && imu(age - 1).time_us <= now_.time_us) --age;
  ImuSample last = imu_at(now_.time_us);
  for (; age > 0; --age) {
    carry(now_, last, imu(age - 1));
    last = imu(age - 1);
  }
}

const StateEstimate& Estimator::on_imu(const ImuSample& sample) {
  ++counters_.imu;
  if (!finite(sample) || (imu_count_ > 0 && sample.time_us <= imu(0).time_us)) {
    ++counters_.imu_rejected;
    return estimate_;
  }
  if (imu_count_ > 0 && sample.time_us - imu(0).time_us > kMaxImuStep_us) ++counters_.imu_gaps;
  // Without poses the horizon follows before the samples that it needs are overwritten.
  if (started_ && imu_count_ == kImuBuffer && horizon_.time_us < imu(kImuBuffer - 2).time_us) roll_to(imu(kImuBuffer - 12).time_us);
  imu_newest_ = imu_count_ == 0 ? 0 : (imu_newest_ + 1) % kImuBuffer;
  imu_[imu_newest_] = sample;
  imu_count_ = std::min(imu_count_ + 1, kImuBuffer);
  if (started_) carry(now_, imu(1), imu(0));

  std::size_t done = 0;
  for (; done < queued_ && queue_[done].time_us <= sample.time_us; ++done) take(queue_[done], queue_[done].time_us);
  if (done > 0) {
    std::move(queue_.begin() + static_cast<std::ptrdiff_t>(done), queue_.begin() + static_cast<std::ptrdiff_t>(queued_), queue_.begin());
    queued_ -= done;
    if (started_) refresh_now();
  }
  publish(sample);
  return estimate_;
}

void Estimator::on_pose(const PoseSample& pose) {
  ++counters_.poses;
  if (!finite(pose)) {
    ++counters_.poses_not_finite;
    return;
  }
  if (imu_count_ == 0) {
    ++counters_.poses_too_old;
    return;
  }
  PoseSample waiting = pose;
  waiting.time_us = config_.compensate_latency
                        ? pose.time_us - static_cast<std::int64_t>(std::floor(config_.pose_stamp_offset_s * 1e6 + 0.5))
                        : imu(0).time_us + 1;  // measured just now, whatever the stamp says
  if (waiting.time_us > imu(0).time_us + kFutureWait_us) {
    ++counters_.poses_from_future;
    return;
  }
  if (queued_ == kPoseQueue) {
    ++counters_.poses_dropped;
    return;
  }
  // Kept in the order of stamps, so that two late ones are fused in the right order.
  std::size_t place = queued_++;
  for (; place > 0 && queue_[place - 1].time_us > waiting.time_us; --place) queue_[place] = queue_[place - 1];
  queue_[place] = waiting;
}

void Estimator::take(const PoseSample& pose, std::int64_t stamp_us) {
  if (stamp_us < imu(imu_count_ - 1).time_us) {
    ++counters_.poses_too_old;
    return;
  }
  if (!started_) {
    initialise(pose, stamp_us);
    return;
  }
  if (stamp_us <= horizon_.time_us) {
    ++counters_.poses_out_of_order;
    return;
  }
  roll_to(stamp_us);
  if (fuse(pose)) {
    ++counters_.poses_fused;
    last_fused_us_ = stamp_us;
    refusing_since_us_ = -1;
  }
}

void Estimator::initialise(const PoseSample& pose, std::int64_t stamp_us) {
  Start& s = start_;
  Eigen::Vector4d q = (pose.q_WS * q_BS_.conjugate()).normalized().coeffs();
  if (s.q.dot(q) < 0.0) q = -q;
  ++s.poses;
  s.p += pose.p_W_m;
  s.v += pose.v_W_m_s;
  s.q += q;
  if (s.poses < config_.start_poses) return;
  const double n = static_cast<double>(s.poses);
  horizon_ = Nominal{};
  horizon_.time_us = stamp_us;
  horizon_.q.coeffs() = s.q.normalized();
  horizon_.p = s.p / n - horizon_.q * p_BS_m_;
  horizon_.v = s.v / n;
  P_.setZero();
  const auto set = [&](Part part, double sigma) { P_.diagonal().segment<3>(part).setConstant(square(sigma)); };
  set(kP, config_.position_noise_m);
  set(kV, config_.velocity_noise_m_s);
  set(kA, config_.attitude_noise_rad);
  set(kGyroBias, config_.gyro_bias_start_rad_s);
  set(kAccelBias, config_.accel_bias_start_m_s2);
  started_ = true;
  last_fused_us_ = stamp_us;
  refresh_now();
}

// At the horizon. False when the pose was refused.
bool Estimator::fuse(const PoseSample& pose) {
  const Matrix3 R = horizon_.q.toRotationMatrix();
  const Vector3 w = imu_at(horizon_.time_us).gyro_B_rad_s - horizon_.gyro_bias;
  const Vector3 swing = w.cross(p_BS_m_);  // velocity of the sensor about the centre of mass, B

  std::array<Measurement, 3> z;
  z[0].residual = pose.p_W_m - horizon_.p - R * p_BS_m_;
  z[0].add(kP, Matrix3::Identity());
  z[0].add(kA, -R * cross_matrix(p_BS_m_));
  z[0].variance = square(config_.position_noise_m);
  z[1].residual = pose.v_W_m_s - horizon_.v - R * swing;
  z[1].add(kV, Matrix3::Identity());
  z[1].add(kA, -R * cross_matrix(swing));
  z[1].add(kGyroBias, R * cross_matrix(p_BS_m_));
  z[1].variance = square(config_.velocity_noise_m_s);
  z[2].residual = small_angle(horizon_.q.conjugate() * (pose.q_WS * q_BS_.conjugate()));
  z[2].add(kA, Matrix3::Identity());
  z[2].variance = square(config_.attitude_noise_rad);

  std::array<bool, 3> outside{};
  bool any = false;
  for (std::size_t i = 0; i < z.size(); ++i) {
    const Matrix3 S = innovation_covariance(z[i], gain_numerator(P_, z[i]));
    const double d2 = z[i].residual.dot(S.inverse() * z[i].residual);
    outside[i] = !(d2 <= square(config_.gate_sigma));
    any |= outside[i];
  }
  if (any) {
    if (refusing_since_us_ < 0) refusing_since_us_ = horizon_.time_us;
    if (static_cast<double>(horizon_.time_us - refusing_since_us_) * kMicro < config_.gate_patience_s) {
      ++counters_.poses_gated;
      return false;
    }
    // The sensor insists: it has relocalised, or we are lost. Forget what disagrees, keep the rest.
    ++counters_.resets;
    constexpr std::array<Part, 3> part{kP, kV, kA};
    constexpr double kForget = 1e4;  // variance relative to the sensor's
    for (std::size_t i = 0; i < z.size(); ++i) {
      if (!outside[i]) continue;
      P_.middleRows<3>(part[i]).setZero();
      P_.middleCols<3>(part[i]).setZero();
      P_.diagonal().segment<3>(part[i]).setConstant(kForget * z[i].variance + z[i].residual.squaredNorm());
    }
  }
  correct(update(P_, z));
  return true;
}

void Estimator::correct(const Error& dx) {
  horizon_.p += dx.segment<3>(kP);
  horizon_.v += dx.segment<3>(kV);
  horizon_.q = (horizon_.q * rotation(dx.segment<3>(kA))).normalized();
  horizon_.gyro_bias += dx.segment<3>(kGyroBias);
  horizon_.accel_bias += dx.segment<3>(kAccelBias);
}

void Estimator::publish(const ImuSample& sample) {
  estimate_.time_us = sample.time_us;
  estimate_.w_B_rad_s = sample.gyro_B_rad_s - now_.gyro_bias;
  estimate_.p_W_m = now_.p;
  estimate_.v_W_m_s = now_.v;
  estimate_.q_WB = now_.q;
  estimate_.valid = started_ && static_cast<double>(sample.time_us - last_fused_us_) * kMicro <= config_.coast_max_s;
}

}  // namespace rotorloop::host
