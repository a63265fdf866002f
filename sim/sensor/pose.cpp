// Measures the sensor point, adds the errors of a sample by its number, and keeps the readings that are under way.
#include "sim/sensor/pose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"
#include "host/base/error.hpp"
#include "sim/sensor/gaussian3.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::uint64_t kPoseNoiseModule = 0x504F534E;  // POSN
constexpr std::uint64_t kDriftModule = 0x504F5344;      // POSD
constexpr std::uint64_t kDelayModule = 0x504F534C;      // POSL
constexpr std::uint64_t kStampModule = 0x504F5353;      // POSS
constexpr std::uint64_t kPoseDraws = 9;

}  // namespace

PoseSensor::PoseSensor(const PoseConfig& config, std::uint64_t seed)
    : config_(config), noise_(seed, kPoseNoiseModule), drift_(seed, kDriftModule), delay_(seed, kDelayModule), stamp_(seed, kStampModule) {
  if (!(config_.jitter_s >= 0.0) || !(config_.latency_s >= config_.jitter_s))
    throw Error({"pose sensor",
                 fmt::format("latency {} s with jitter {} s would arrive before it was measured", config_.latency_s, config_.jitter_s), "",
                 "keep 0 <= jitter_s <= latency_s"});
  if (config_.rate_Hz <= 0 ||
      (config_.latency_s + config_.jitter_s) * static_cast<double>(config_.rate_Hz) > static_cast<double>(kQueue - 2))
    throw Error({"pose sensor",
                 fmt::format("{} Hz with {} s of delay has more than {} readings under way", config_.rate_Hz,
                             config_.latency_s + config_.jitter_s, kQueue - 2),
                 "", "lower rate_Hz or latency_s"});
  if (!(config_.drift_tau_s > 0.0))
    throw Error({"pose sensor", fmt::format("drift_tau_s {} s is not positive", config_.drift_tau_s), "", "give it in s"});
  config_.q_BS.normalize();
  drift_keep_ = exp_exact(-1.0 / (static_cast<double>(config_.rate_Hz) * config_.drift_tau_s));
  drift_drive_ = config_.drift_m * std::sqrt(1.0 - drift_keep_ * drift_keep_);
}

PoseArrival PoseSensor::sample(std::int64_t n, const AirframeState& state) {
  const auto k = static_cast<std::uint64_t>(n);
  if (config_.drift_enabled) {
    const Eigen::Vector3d draw = gaussian3(drift_, 3 * k);
    drift_W_m_ = n == 0 ? Eigen::Vector3d(config_.drift_m * draw) : Eigen::Vector3d(drift_keep_ * drift_W_m_ + drift_drive_ * draw);
  }
  const std::uint64_t first = k * kPoseDraws;
  const Eigen::Vector3d turn_rad = config_.noise_rad * gaussian3(noise_, first + 3);
  const Eigen::Quaterniond small(1.0, 0.5 * turn_rad.x(), 0.5 * turn_rad.y(), 0.5 * turn_rad.z());  // normalised below

  PoseArrival a;
  a.reading.time_ns = state.time_ns;
  a.reading.p_W_m = state.p_W_m + state.q_WB * config_.offset_B_m + drift_W_m_ + config_.noise_m * gaussian3(noise_, first);
  a.reading.q_WS = (state.q_WB * config_.q_BS * small).normalized();
  a.reading.v_W_m_s =
      state.v_W_m_s + state.q_WB * state.w_B_rad_s.cross(config_.offset_B_m) + config_.velocity_noise_m_s * gaussian3(noise_, first + 6);

  apply_defects(a.reading, k);
  const double delay_s = config_.latency_s + config_.jitter_s * (2.0 * delay_.uniform(k) - 1.0);
  a.arrival_time_ns = std::max(last_arrival_ns_, state.time_ns + static_cast<std::int64_t>(delay_s * 1e9));
  last_arrival_ns_ = a.arrival_time_ns;

  if (count_ == kQueue) {
    head_ = (head_ + 1) % kQueue;
    --count_;
    ++lost_;
  }
  queue_[(head_ + count_++) % kQueue] = a;
  return a;
}

void PoseSensor::apply_defects(PoseReading& r, std::uint64_t sample) const {
  const double stamp_s = config_.stamp_error_s + config_.stamp_rate_error * (1e-9 * static_cast<double>(r.time_ns)) +
                         (config_.stamp_jitter_s > 0.0 ? config_.stamp_jitter_s * stamp_.gaussian(sample) : 0.0);
  r.time_ns += static_cast<std::int64_t>(stamp_s * 1e9);
  if (config_.scale_error != 0.0) {
    r.p_W_m *= 1.0 + config_.scale_error;
    r.v_W_m_s *= 1.0 + config_.scale_error;
  }
  if (config_.tilt_rad != Eigen::Vector2d::Zero()) {
    const SinCos x = sincos_exact(0.5 * config_.tilt_rad.x()), y = sincos_exact(0.5 * config_.tilt_rad.y());
    const Eigen::Quaterniond tilt = Eigen::Quaterniond(x.cos, x.sin, 0.0, 0.0) * Eigen::Quaterniond(y.cos, 0.0, y.sin, 0.0);
    r.p_W_m = tilt * r.p_W_m;
    r.v_W_m_s = tilt * r.v_W_m_s;
    r.q_WS = (tilt * r.q_WS).normalized();
  }
}

std::optional<PoseReading> PoseSensor::take(std::int64_t now_ns) {
  if (count_ == 0 || queue_[head_].arrival_time_ns > now_ns) return std::nullopt;
  const PoseReading reading = queue_[head_].reading;
  head_ = (head_ + 1) % kQueue;
  --count_;
  return reading;
}

std::optional<std::int64_t> PoseSensor::next_arrival_ns() const {
  if (count_ == 0) return std::nullopt;
  return queue_[head_].arrival_time_ns;
}

}  // namespace rotorloop::sim
