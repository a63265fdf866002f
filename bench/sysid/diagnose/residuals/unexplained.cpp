#include "bench/sysid/diagnose/residuals/unexplained.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/statistics.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::size_t kChanceFits = 4;
// What the additive fit may use: the motion, rotors, the place and time, each once. Nothing that contains the residual's own acceleration.
constexpr std::string_view kExplaining[] = {
    "v_x",         "v_y",       "v_z",       "rate_x",         "rate_y",          "rate_z",        "omega",   "omega_roll",
    "omega_pitch", "omega_yaw", "omega_dot", "omega_dot_roll", "omega_dot_pitch", "omega_dot_yaw", "heading", "place_x",
    "place_y",     "height",    "time"};

std::vector<double> sliding_power(const Samples& samples, std::vector<double> v, double window_s) {
  for (double& x : v) x *= x;
  return sliding_mean(samples, v, window_s);
}

double largest_ratio(const Samples& samples, const std::vector<double>& v, double window_s) {
  const std::vector<double> power = sliding_power(samples, v, window_s);
  const double usual = quantile(power, 0.5);
  return usual > 0.0 ? std::sqrt(*std::max_element(power.begin(), power.end()) / usual) : 0.0;
}

// Either way of leaving out may show what the other cannot; simulated residuals go through both.
std::vector<AdditiveFit> predicted_either_way(const Samples& samples, std::span<const std::vector<double>* const> series,
                                              std::span<const Channel> used, const AdditiveOptions& flights) {
  std::vector<AdditiveFit> out = additive_fit(samples, series, used, kAxes, flights);
  AdditiveOptions runs = flights;
  runs.left_out = LeftOut::runs;
  std::vector<AdditiveFit> by_runs = additive_fit(samples, series, used, kAxes, runs);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (by_runs[i].share > out[i].share) out[i] = std::move(by_runs[i]);
  }
  return out;
}

}  // namespace

std::string_view name(ResidualKind k) {
  switch (k) {
    case ResidualKind::none:
      return "none";
    case ResidualKind::systematic:
      return "systematic";
    case ResidualKind::bursts:
      return "bursts";
    case ResidualKind::stochastic:
      return "stochastic";
  }
  return "";
}

std::vector<Burst> bursts(const Samples& samples, const std::vector<double>& v, std::size_t axis, double window_s, double limit) {
  std::vector<Burst> out;
  const std::vector<double> power = sliding_power(samples, v, window_s);
  const double usual = std::sqrt(quantile(power, 0.5));
  if (!(usual > 0.0)) return out;
  for (const Piece& p : samples.pieces) {
    const auto window = static_cast<std::size_t>(std::max(1.0, std::round(window_s / p.step_s)));
    for (std::size_t i = 0; i < p.count;) {
      if (std::sqrt(power[p.first + i]) <= limit * usual) {
        ++i;
        continue;
      }
      std::size_t last = i;  // gaps up to a window are part of the burst
      for (std::size_t j = i; j < p.count && j <= last + window; ++j) {
        if (std::sqrt(power[p.first + j]) > limit * usual) last = j;
      }
      Burst b{.flight = p.flight,
              .axis = axis,
              .from_s = p.start_s + static_cast<double>(i) * p.step_s,
              .to_s = p.start_s + static_cast<double>(last + 1) * p.step_s};
      for (std::size_t j = i; j <= last; ++j) {
        const double x = v[p.first + j];
        b.mean += x / static_cast<double>(last - i + 1);
        if (std::fabs(x) > std::fabs(b.peak)) b.peak = x;
        b.ratio = std::max(b.ratio, std::sqrt(power[p.first + j]) / usual);
      }
      out.push_back(b);
      i = last + 1;
    }
  }
  return out;
}

UnexplainedResult unexplained(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                              const UnexplainedOptions& o) {
  UnexplainedResult out;
  out.burst_window_s = o.burst_window_s;
  if (samples.size == 0) return out;
  std::vector<Channel> used;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (std::find(std::begin(kExplaining), std::end(kExplaining), inputs[i].id) == std::end(kExplaining)) continue;
    used.push_back(inputs[i]);
    index.push_back(i);
  }
  std::vector<const std::vector<double>*> series;
  for (const auto& a : residual) series.push_back(&a);
  const std::size_t chance = std::min(kChanceFits, expected.size());
  for (std::size_t n = 0; n < chance; ++n) {
    for (const auto& a : expected[n]) series.push_back(&a);
  }
  std::vector<AdditiveFit> fits = predicted_either_way(samples, series, used, o.fit);
  for (std::size_t a = 0; a < kAxes; ++a) {
    AxisUnexplained& x = out.axis[a];
    x.rms = std::sqrt(mean_square(residual[a]));
    std::vector<double> ratios;
    for (const Axes& e : expected) {
      x.rms_expected += mean_square(e[a]) / static_cast<double>(expected.size());
      ratios.push_back(largest_ratio(samples, e[a], o.burst_window_s));
    }
    x.rms_expected = std::sqrt(x.rms_expected);
    for (std::size_t n = 0; n < chance; ++n) x.explainable_by_chance = std::max(x.explainable_by_chance, fits[(n + 1) * kAxes + a].share);
    x.explainable = std::move(fits[a]);
    for (PartialCurve& c : x.explainable.curves) c.input = index[c.input];
    out.burst_limit[a] = std::max(o.criteria.fewest_u, quantile(ratios, 1.0 - o.criteria.chance));
    const std::vector<Burst> found = bursts(samples, residual[a], a, o.burst_window_s, out.burst_limit[a]);
    double in_bursts = 0.0;
    for (const Burst& b : found) {
      for (const Piece& p : samples.pieces) {
        if (p.flight != b.flight) continue;
        for (std::size_t i = 0; i < p.count; ++i) {
          const double t = p.start_s + static_cast<double>(i) * p.step_s;
          if (t >= b.from_s && t < b.to_s) in_bursts += residual[a][p.first + i] * residual[a][p.first + i];
        }
      }
    }
    const double power = x.rms * x.rms * static_cast<double>(samples.size);
    x.burst_share = power > 0.0 ? in_bursts / power : 0.0;
    out.bursts.insert(out.bursts.end(), found.begin(), found.end());
    const bool real = expected.empty() || x.rms > 1.15 * x.rms_expected;
    const bool predicted =
        x.explainable.share > o.criteria.negligible && x.explainable_by_chance < o.criteria.larger_part * x.explainable.share;
    out.kind[a] = predicted                                ? ResidualKind::systematic
                  : x.burst_share > o.criteria.larger_part ? ResidualKind::bursts
                  : real                                   ? ResidualKind::stochastic
                                                           : ResidualKind::none;
  }
  std::stable_sort(out.bursts.begin(), out.bursts.end(),
                   [](const Burst& p, const Burst& q) { return p.flight != q.flight ? p.flight < q.flight : p.from_s < q.from_s; });
  return out;
}

}  // namespace rotorloop::diagnose
