#include "bench/sysid/estimate/model/rotor_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/sysid/estimate/model/local_parabola.hpp"
#include "host/base/error.hpp"

namespace rotorloop::estimate {
namespace {

using Four = std::array<double, 4>;

// Value of a stream at time t: linear between samples, held outside.
double interpolated(const log::Stream<double>& s, double t, std::size_t& i) {
  while (i + 1 < s.size() && s.t_s[i + 1] <= t) ++i;
  if (t <= s.t_s.front() || i + 1 >= s.size()) return t <= s.t_s.front() ? s.value.front() : s.value.back();
  const double a = (t - s.t_s[i]) / (s.t_s[i + 1] - s.t_s[i]);
  return s.value[i] + a * (s.value[i + 1] - s.value[i]);
}

// Fills missing measurements of one rotor by straight lines between its neighbours.
void bridge(std::vector<Four>& values, const std::vector<double>& t, std::size_t rotor) {
  const std::size_t n = values.size();
  std::size_t last = n;
  for (std::size_t k = 0; k < n; ++k) {
    if (!std::isfinite(values[k][rotor])) continue;
    for (std::size_t j = last == n ? 0 : last + 1; j < k; ++j) {
      const double a = last == n ? 1.0 : (t[j] - t[last]) / (t[k] - t[last]);
      values[j][rotor] = last == n ? values[k][rotor] : values[last][rotor] + a * (values[k][rotor] - values[last][rotor]);
    }
    last = k;
  }
  if (last != n) {
    for (std::size_t j = last + 1; j < n; ++j) values[j][rotor] = values[last][rotor];
  }
}

}  // namespace

RotorInput::RotorInput(const log::FlightRecord& record, double rate_window_s, double longest_gap_s) : rate_window_s_(rate_window_s) {
  from_commands_ = record.rotor_omega_rad_s.empty();
  const log::Stream<log::RotorValues>& s = from_commands_ ? record.motor_command : record.rotor_omega_rad_s;
  if (s.size() < 2) {
    throw Error({.where = record.source.empty() ? record.name : record.source,
                 .what = fmt::format("{} samples of rotor speed and {} of motor commands; the model needs at least 2 of one of them",
                                     record.rotor_omega_rad_s.size(), record.motor_command.size()),
                 .likely = "the log does not hold them, or the mapping file does not name their columns",
                 .remedy = "log rotor speeds, or commands and battery voltage, and name their columns in the mapping file"},
                ExitCode::data_quality);
  }
  t_s_ = s.t_s;
  gap_after_.assign(t_s_.size(), false);
  for (std::size_t k = 0; k + 1 < t_s_.size(); ++k) gap_after_[k] = t_s_[k + 1] - t_s_[k] > longest_gap_s;
  std::vector<Four> values = s.value;
  for (std::size_t r = 0; r < 4; ++r) {
    std::size_t last = 0;
    bool seen = false;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (!std::isfinite(values[k][r])) continue;
      if (t_s_[k] - t_s_[seen ? last : 0] > longest_gap_s) {
        for (std::size_t j = seen ? last : 0; j < k; ++j) gap_after_[j] = true;
      }
      last = k;
      seen = true;
    }
    for (std::size_t j = seen ? last : 0; j + 1 < values.size() && t_s_.back() - t_s_[last] > longest_gap_s; ++j) gap_after_[j] = true;
    bridge(values, t_s_, r);
  }
  if (!record.battery_V.empty()) {
    std::size_t i = 0;
    for (const double t : t_s_) battery_V_.push_back(interpolated(record.battery_V, t, i));
  }
  if (from_commands_) {
    command_ = std::move(values);
    omega_.assign(t_s_.size(), Four{});
  } else {
    omega_ = std::move(values);
  }
  if (!from_commands_) smooth();
  slopes(rate_window_s_);
}

// Measurements at a high rate scatter, and a fit that moves them in time (their delay) would climb over every one of them. Where there are
// enough, the parabola through those around stands for a measurement. Over more of the window it would round the corners that commands
// leave.
void RotorInput::smooth() {
  constexpr double kMeasurementsForParabola = 6.5;  // measurements in the window
  const std::vector<Four> raw = omega_;
  const double half = rate_window_s_ / 3.0;
  std::size_t from = 0;
  for (std::size_t k = 0; k < raw.size(); ++k) {
    while (t_s_[from] < t_s_[k] - half) ++from;
    LocalParabola<4> window;
    for (std::size_t j = from; j < raw.size() && t_s_[j] <= t_s_[k] + half; ++j)
      window.add((t_s_[j] - t_s_[k]) / half, Eigen::Map<const Eigen::Vector4d>(raw[j].data()));
    if (window.count() > kMeasurementsForParabola) Eigen::Map<Eigen::Vector4d>(omega_[k].data()) = window.at_moment();
  }
}

// Least-squares slope through the samples within half a window: noise and quantisation of the measurement would otherwise be
// differentiated at full sampling rate.
void RotorInput::slopes(double window_s) {
  const std::size_t n = t_s_.size();
  omega_dot_.assign(n, Four{});
  std::size_t from = 0, to = 0;
  for (std::size_t k = 0; k < n; ++k) {
    while (t_s_[from] < t_s_[k] - 0.5 * window_s) ++from;
    while (to + 1 < n && t_s_[to + 1] <= t_s_[k] + 0.5 * window_s) ++to;
    std::size_t a = from, b = to;
    if (b == a || (b - a == 1 && k > 0 && k + 1 < n)) {  // fewer than three: the neighbours on both sides
      a = k > 0 ? k - 1 : k;
      b = std::min(k + 1, n - 1);
    }
    double mean_t = 0.0;
    Four mean{};
    const double count = static_cast<double>(b - a + 1);
    for (std::size_t j = a; j <= b; ++j) {
      mean_t += t_s_[j] / count;
      for (std::size_t r = 0; r < 4; ++r) mean[r] += omega_[j][r] / count;
    }
    double tt = 0.0;
    Four tw{};
    for (std::size_t j = a; j <= b; ++j) {
      const double dt = t_s_[j] - mean_t;
      tt += dt * dt;
      for (std::size_t r = 0; r < 4; ++r) tw[r] += dt * (omega_[j][r] - mean[r]);
    }
    for (std::size_t r = 0; r < 4; ++r) omega_dot_[k][r] = tt > 0.0 ? tw[r] / tt : 0.0;
  }
}

bool RotorInput::covers(double from_s, double to_s) const {
  if (from_s < t_s_.front() - 1e-6 || to_s > t_s_.back() + 1e-6) return false;
  for (std::size_t k = interval(from_s, 0); k + 1 < t_s_.size() && t_s_[k] < to_s; ++k) {
    if (gap_after_[k]) return false;
  }
  return true;
}

void RotorInput::prepare(const ModelValues& v, bool derivatives) {
  delay_s_ = v[kRotorDelay];
  if (from_commands_) run_motors(v);
  std::size_t hint = 0;
  memory_.prepare(
      v, [&](double t_s) { return at(t_s, hint, false); }, derivatives);
}

// With commands: ω̇ = (ω_target - ω) / lag, exact for a target that is held between samples, and its derivatives by the same rule.
void RotorInput::run_motors(const ModelValues& v) {
  const std::size_t n = t_s_.size();
  const double gain = v[kCommandGain], offset = v[kCommandOffset], exponent = v[kVoltageExponent], lag = v[kCommandLag];
  for (auto& b : by_) b.assign(n, Four{});
  for (auto& b : dot_by_) b.assign(n, Four{});
  omega_dot_.assign(n, Four{});
  Four omega{};
  std::array<Four, 4> by{};
  for (std::size_t k = 0; k < n; ++k) {
    const double ratio = battery_V_.empty() || v.reference_V <= 0.0 || !(battery_V_[k] > 0.0) ? 1.0 : battery_V_[k] / v.reference_V;
    const double power = std::pow(ratio, exponent);
    const double h = k + 1 < n ? t_s_[k + 1] - t_s_[k] : 0.0, decay = std::exp(-h / lag);
    for (std::size_t r = 0; r < 4; ++r) {
      const double u = command_[k][r], target = (offset + gain * u) * power;
      const std::array<double, 3> target_by{u * power, power, target * std::log(ratio)};
      if (k == 0) {
        omega[r] = target;
        for (std::size_t j = 0; j < 3; ++j) by[j][r] = target_by[j];
        by[3][r] = 0.0;
      }
      omega_[k][r] = omega[r];
      omega_dot_[k][r] = (target - omega[r]) / lag;
      for (std::size_t j = 0; j < 3; ++j) {
        by_[j][k][r] = by[j][r];
        dot_by_[j][k][r] = (target_by[j] - by[j][r]) / lag;
      }
      by_[3][k][r] = by[3][r];
      dot_by_[3][k][r] = -by[3][r] / lag - (target - omega[r]) / (lag * lag);
      by[3][r] = decay * by[3][r] + (omega[r] - target) * decay * h / (lag * lag);
      for (std::size_t j = 0; j < 3; ++j) by[j][r] = target_by[j] + (by[j][r] - target_by[j]) * decay;
      omega[r] = target + (omega[r] - target) * decay;
    }
  }
}

std::size_t RotorInput::interval(double t, std::size_t hint) const {
  std::size_t k = std::min(hint, t_s_.size() - 2);
  if (t_s_[k] <= t && t < t_s_[k + 1]) return k;
  if (k + 2 < t_s_.size() && t_s_[k + 1] <= t && t < t_s_[k + 2]) return k + 1;
  const auto next = std::upper_bound(t_s_.begin(), t_s_.end(), t);
  const auto i = static_cast<std::size_t>(next - t_s_.begin());
  return std::clamp<std::size_t>(i, 1, t_s_.size() - 1) - 1;
}

RotorInputSample RotorInput::at(double t_s, std::size_t& hint, bool derivatives) const {
  const double t = t_s + delay_s_;
  const std::size_t k = interval(t, hint);
  hint = k;
  const double width = t_s_[k + 1] - t_s_[k];
  const double raw = (t - t_s_[k]) / width, a = std::clamp(raw, 0.0, 1.0);
  const bool inside = raw == a;
  RotorInputSample out;
  for (std::size_t r = 0; r < 4; ++r) {
    out.omega_rad_s[r] = omega_[k][r] + a * (omega_[k + 1][r] - omega_[k][r]);
    out.omega_dot_rad_s2[r] = omega_dot_[k][r] + a * (omega_dot_[k + 1][r] - omega_dot_[k][r]);
    if (!derivatives) continue;
    out.omega_by[0][r] = inside ? (omega_[k + 1][r] - omega_[k][r]) / width : 0.0;
    out.omega_dot_by[0][r] = inside ? (omega_dot_[k + 1][r] - omega_dot_[k][r]) / width : 0.0;
    if (!from_commands_) continue;
    for (std::size_t j = 0; j < 4; ++j) {
      out.omega_by[j + 1][r] = by_[j][k][r] + a * (by_[j][k + 1][r] - by_[j][k][r]);
      out.omega_dot_by[j + 1][r] = dot_by_[j][k][r] + a * (dot_by_[j][k + 1][r] - dot_by_[j][k][r]);
    }
  }
  if (!battery_V_.empty()) out.battery_V = battery_V_[k] + a * (battery_V_[k + 1] - battery_V_[k]);
  memory_.at(t_s, out);
  return out;
}

RotorInputSample RotorInput::mean(double from_s, double to_s, int parts, std::size_t& hint, bool derivatives) const {
  const double h = (to_s - from_s) / (2.0 * parts);
  RotorInputSample out;
  Four by_delay{}, dot_by_delay{};
  const auto add = [](auto& sum, const auto& more, double weight) {
    for (std::size_t r = 0; r < 4; ++r) sum[r] += weight * more[r];
  };
  for (int i = 0; i <= 2 * parts; ++i) {
    const double weight = (i == 0 || i == 2 * parts ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) / (6.0 * parts);
    const RotorInputSample u = at(from_s + i * h, hint, derivatives);
    add(out.omega_rad_s, u.omega_rad_s, weight);
    add(out.omega_dot_rad_s2, u.omega_dot_rad_s2, weight);
    for (std::size_t j = 0; derivatives && j < u.omega_by.size(); ++j) {
      add(out.omega_by[j], u.omega_by[j], weight);
      add(out.omega_dot_by[j], u.omega_dot_by[j], weight);
    }
    if (derivatives && (i == 0 || i == 2 * parts)) {  // by the delay: what the ends say is exact for a mean
      const double per_s = (i == 0 ? -1.0 : 1.0) / (to_s - from_s);
      for (std::size_t r = 0; r < 4; ++r) {
        by_delay[r] += per_s * u.omega_rad_s[r];
        dot_by_delay[r] += per_s * u.omega_dot_rad_s2[r];
      }
    }
    if (i != parts) continue;
    out.battery_V = u.battery_V;
    out.memory = u.memory;
    out.dynamic_term_input = u.dynamic_term_input;
    out.memory_row = u.memory_row;
    out.memory_share = u.memory_share;
  }
  if (derivatives) {
    out.omega_by[0] = by_delay;
    out.omega_dot_by[0] = dot_by_delay;
  }
  return out;
}

}  // namespace rotorloop::estimate
