#include "bench/sysid/diagnose/ranking/gust.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::diagnose {
namespace {

constexpr double kBlock_s = 0.2;
constexpr double kShortest_s = 0.3, kLongest_s = 10.0, kTimesPerDecade = 8.0;
constexpr double kRatiosPerDecade = 6.0, kSmallestRatio = 1e-2, kLargestRatio = 1e3;

// -log likelihood of y = a + n with var(n) = 1 and var(a) = ratio, but for a common scale, which is put at its best: the sum of squares
// of innovations over their variances, and the sum of the variances' logarithms.
struct Likelihood {
  double squares = 0.0, logs = 0.0, count = 0.0;
  double value() const { return count > 0.0 && squares > 0.0 ? -0.5 * (count * std::log(squares / count) + logs + count) : 0.0; }
};

Likelihood filtered(std::span<const std::vector<double>> series, double ratio, double stays) {
  Likelihood l;
  for (const std::vector<double>& y : series) {
    double a = 0.0, variance = ratio;
    for (const double v : y) {
      const double s = variance + 1.0, e = v - a, gain = variance / s;
      l.squares += e * e / s;
      l.logs += std::log(s);
      l.count += 1.0;
      a = stays * (a + gain * e);
      variance = stays * stays * (1.0 - gain) * variance + (1.0 - stays * stays) * ratio;
    }
  }
  return l;
}

}  // namespace

ColouredNoise coloured_noise(std::span<const std::vector<double>> given, double step_s) {
  std::vector<std::vector<double>> series(given.begin(), given.end());
  for (auto& y : series) {
    double mean = 0.0;
    for (const double v : y) mean += v / static_cast<double>(y.size());
    for (double& v : y) v -= mean;
  }
  const Likelihood white = filtered(series, 0.0, 0.0);
  ColouredNoise best;
  if (white.count < 10.0 || white.squares <= 0.0) return best;
  best.white = std::sqrt(white.squares / white.count);
  double highest = white.value();
  const double base = highest;
  for (double time_s = kShortest_s; time_s <= kLongest_s; time_s *= std::pow(10.0, 1.0 / kTimesPerDecade)) {
    for (double ratio = kSmallestRatio; ratio <= kLargestRatio; ratio *= std::pow(10.0, 1.0 / kRatiosPerDecade)) {
      const Likelihood l = filtered(series, ratio, std::exp(-step_s / time_s));
      if (l.value() <= highest) continue;
      highest = l.value();
      const double scale = std::sqrt(l.squares / l.count);
      best = {std::sqrt(ratio) * scale, time_s, scale, highest - base};
    }
  }
  return best;
}

GustScore score_gust(const identify::Identification& r) {
  std::array<std::vector<std::vector<double>>, 3> series;
  double slope = 0.0, slopes = 0.0;
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::GridFlight& g = r.flights[f];
    const std::vector<estimate::BodyState>& x = r.fit.states[f];
    estimate::RotorInput input = g.input;
    input.prepare(r.fit.values[f]);
    const estimate::Model model(r.fit.values[f]);
    const auto block = static_cast<std::size_t>(std::max(1.0, std::round(kBlock_s / g.step_s)));
    std::size_t hint = 0;
    for (auto& axis : series) axis.emplace_back();
    for (std::size_t k = 0; k + block < g.nodes; k += block) {
      Eigen::Vector3d change = Eigen::Vector3d::Zero();
      bool whole = true;
      for (std::size_t j = k; j < k + block && whole; ++j) {
        whole = g.linked[j];
        if (whole) {
          const estimate::BodyState ahead = model.step(x[j], input, hint, g.time_s(j), g.time_s(j + 1), g.substeps);
          change += x[j + 1].v_W_m_s - ahead.v_W_m_s;
        }
      }
      if (!whole) {  // across a gap nothing is known of the wind before it
        for (auto& axis : series) {
          if (!axis.back().empty()) axis.emplace_back();
        }
        continue;
      }
      for (std::size_t i = 0; i < 3; ++i)
        series[i].back().push_back(change[static_cast<Eigen::Index>(i)] / (static_cast<double>(block) * g.step_s));
      estimate::InstantJacobian j;
      model.instant(x[k], input.at(g.time_s(k), hint, false), g.time_s(k), &j);
      const Eigen::Matrix3d by_velocity_W = x[k].q_WB.toRotationMatrix() * j.force_by_state.block<3, 3>(0, 3);
      slope -= 0.5 * (by_velocity_W(0, 0) + by_velocity_W(1, 1));
      slopes += 1.0;
    }
  }
  GustScore out;
  for (std::size_t i = 0; i < 3; ++i) {
    std::erase_if(series[i], [](const auto& y) { return y.size() < 5; });
    out.axis[i] = coloured_noise(series[i], kBlock_s);
  }
  out.drag_slope_1_s = slopes > 0.0 ? slope / slopes : 0.0;
  out.gain = out.axis[0].gain + out.axis[1].gain;
  const double variance = 0.5 * (out.axis[0].sigma * out.axis[0].sigma + out.axis[1].sigma * out.axis[1].sigma);
  if (out.gain > 0.0 && out.drag_slope_1_s > 0.0) {
    out.sigma_m_s = std::sqrt(variance) / out.drag_slope_1_s;
    out.time_s = (out.axis[0].gain * out.axis[0].time_s + out.axis[1].gain * out.axis[1].time_s) / out.gain;
  }
  return out;
}

const host::CatalogueEffect& gusts() { return host::effect("wind_dryden"); }

bool gusts_matter(const GustScore& gust, const Criteria& criteria) {
  constexpr double kTwoBlocks_s = 1.0;
  return gust.time_s > kTwoBlocks_s && gust.sigma_m_s > criteria.relevant * std::fabs(gusts().parameter.typical_value);
}

static bool is_wind(const Candidate& c) { return c.term && c.term->info.traits.mean_wind; }

void reject_explained_by_gusts(const GustScore& gust, std::vector<RefitCandidate>& ranked, const Criteria& criteria) {
  if (ranked.empty() || !gusts_matter(gust, criteria)) return;
  const RefitCandidate& first = ranked.front();
  double wind_m_s = 0.0;
  if (first.failure.none() && is_wind(*first.tested->candidate)) {
    for (const NamedValue& v : first.values) wind_m_s = std::hypot(wind_m_s, v.value);
  }
  const bool their_mean = wind_m_s > 0.0 && wind_m_s < criteria.fewest_u * gust.sigma_m_s;
  for (RefitCandidate& c : ranked) {
    if (!c.failure.none() || (!their_mean && c.delta_log_likelihood >= gust.gain)) continue;
    c.failure = their_mean ? Reason{Rejection::mean_of_gusts, {{"wind", "m/s", wind_m_s, criteria.fewest_u * gust.sigma_m_s}}}
                           : Reason{Rejection::gusts, {{"delta_log_likelihood", "1", c.delta_log_likelihood, gust.gain}}};
    c.failure.figures.push_back({"gust_sigma", "m/s", gust.sigma_m_s});
    c.failure.figures.push_back({"gust_time", "s", gust.time_s});
  }
}

}  // namespace rotorloop::diagnose
