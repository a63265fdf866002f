#include "bench/sysid/diagnose/residuals/lag.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/random.hpp"
#include "host/base/statistics.hpp"
#include "host/vehicle/effect_catalogue.hpp"

namespace rotorloop::diagnose {
namespace {

using host::effect;

constexpr std::uint64_t kLagBootstrap = 0x4C414721u;

// Less the mean over `window_s` around each sample.
std::vector<double> detrended(const Samples& samples, const std::vector<double>& v, double window_s) {
  std::vector<double> out = sliding_mean(samples, v, window_s);
  for (std::size_t i = 0; i < v.size(); ++i) out[i] = v[i] - out[i];
  return out;
}

// Sums of a block for each lag.
struct Sums {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  void operator+=(const Sums& o) {
    xx += o.xx;
    xy += o.xy;
    yy += o.yy;
  }
  double share() const { return xx > 0.0 && yy > 0.0 ? xy * std::fabs(xy) / (xx * yy) : 0.0; }
};

// Top of the parabola through the best lag and its neighbours.
double refined(const std::vector<double>& lag, const std::vector<double>& share, std::size_t best) {
  if (best == 0 || best + 1 >= lag.size()) return lag[best];
  const double a = share[best - 1], b = share[best], c = share[best + 1], bend = a - 2.0 * b + c;
  return bend < 0.0 ? lag[best] + 0.5 * (a - c) / bend * (lag[best + 1] - lag[best]) : lag[best];
}

std::string ms(double s) { return fmt::format("{:.0f}", 1e3 * s); }

std::string axis_list(const std::vector<std::size_t>& axes) {
  std::string out;
  for (std::size_t i = 0; i < axes.size(); ++i)
    out += (i == 0 ? "" : i + 1 == axes.size() ? " and " : ", ") + std::string(kAxisNames[axes[i]]);
  return out;
}

LagFinding leading_yaw(const AxisLag& a) {
  LagFinding f{LagVerdict::leads, {a.axis}, a.lag_s, {effect("rotor_inertia_reaction").id}, ""};
  f.words = fmt::format(
      "torque z, and it alone, leads the model's by {} ms (95 %: {} to {}): a response before its cause. Drag of the rotors follows their "
      "speed; what leads it is the reaction to their acceleration (rotor_inertia_reaction), which this model lacks.",
      ms(-a.lag_s), ms(-a.high_s), ms(-a.low_s));
  return f;
}

// The block sums of one axis for each lag, laid out block by block.
struct LaggedSums {
  std::size_t lags = 0;
  std::vector<Sums> block, total;
};

std::vector<std::size_t> pieces_of(const Samples& samples, const std::vector<SampleBlock>& blocks) {
  std::vector<std::size_t> piece_of(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::size_t p = 0; p < samples.pieces.size(); ++p) {
      if (blocks[b].first >= samples.pieces[p].first && blocks[b].first < samples.pieces[p].first + samples.pieces[p].count)
        piece_of[b] = p;
    }
  }
  return piece_of;
}

// Sums of x, shifted by up to `reach` samples, and y, over the samples that have a partner at every lag.
LaggedSums correlate(const Samples& samples, const std::vector<SampleBlock>& blocks, const std::vector<double>& x,
                     const std::vector<double>& y, int reach) {
  const std::vector<std::size_t> piece_of = pieces_of(samples, blocks);
  LaggedSums out{.lags = static_cast<std::size_t>(2 * reach + 1), .block = {}, .total = {}};
  out.block.resize(blocks.size() * out.lags);
  out.total.resize(out.lags);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Piece& p = samples.pieces[piece_of[b]];
    const auto first = static_cast<long>(p.first), last = static_cast<long>(p.first + p.count);
    for (int l = -reach; l <= reach; ++l) {
      Sums& s = out.block[b * out.lags + static_cast<std::size_t>(l + reach)];
      const long from = std::max(static_cast<long>(blocks[b].first), first + std::max(0, reach));
      const long to = std::min(static_cast<long>(blocks[b].first + blocks[b].count), last - reach);
      for (long i = from; i < to; ++i) {
        const double u = x[static_cast<std::size_t>(i - l)], v = y[static_cast<std::size_t>(i)];
        s.xx += u * u;
        s.xy += u * v;
        s.yy += v * v;
      }
      out.total[static_cast<std::size_t>(l + reach)] += s;
    }
  }
  return out;
}

std::size_t best_of(const std::vector<double>& shares) {
  return static_cast<std::size_t>(std::max_element(shares.begin(), shares.end()) - shares.begin());
}

// The lags of bootstrap samples: blocks drawn with replacement.
std::vector<double> bootstrap_lags(const LaggedSums& sums, const AxisLag& axis, const LagOptions& o) {
  const RandomStream random(o.seed, kLagBootstrap + axis.axis);
  const std::size_t blocks = sums.block.size() / sums.lags;
  std::uint64_t drawn = 0;
  std::vector<double> lags, shares(sums.lags);
  for (int n = 0; n < o.resamples; ++n) {
    std::vector<Sums> again(sums.lags);
    for (std::size_t b = 0; b < blocks; ++b) {
      const auto pick = static_cast<std::size_t>(random.uniform(drawn++) * static_cast<double>(blocks));
      for (std::size_t l = 0; l < sums.lags; ++l) again[l] += sums.block[pick * sums.lags + l];
    }
    for (std::size_t l = 0; l < sums.lags; ++l) shares[l] = again[l].share();
    lags.push_back(refined(axis.tried_s, shares, best_of(shares)));
  }
  return lags;
}

AxisLag lag_of(std::size_t axis, const LaggedSums& sums, int reach, double step_s, const LagOptions& o) {
  AxisLag r;
  r.axis = axis;
  for (int l = -reach; l <= reach; ++l) {
    r.tried_s.push_back(l * step_s);
    r.shares.push_back(sums.total[static_cast<std::size_t>(l + reach)].share());
  }
  const std::size_t best = best_of(r.shares);
  r.lag_s = refined(r.tried_s, r.shares, best);
  r.share = r.shares[best];
  r.share_at_zero = r.shares[static_cast<std::size_t>(reach)];
  r.slope = sums.total[best].xx > 0.0 ? sums.total[best].xy / sums.total[best].xx : 0.0;
  const std::vector<double> lags = bootstrap_lags(sums, r, o);
  r.low_s = quantile(lags, 0.025);
  r.high_s = quantile(lags, 0.975);
  // An interval that touches the ends of the search, or is wider than a quarter of it, gives no lag.
  r.known = r.share > 0.1 && r.low_s > -0.95 * o.range_s && r.high_s < 0.95 * o.range_s && r.high_s - r.low_s < 0.5 * o.range_s;
  return r;
}

LagFinding leading(const std::vector<std::size_t>& axes, double lag_s, bool others_at_rest) {
  LagFinding f{LagVerdict::leads, axes, lag_s, {}, ""};
  const bool several = axes.size() > 1, yaw = std::find(axes.begin(), axes.end(), std::size_t{5}) != axes.end();
  f.words =
      fmt::format("{} {} the model's by {} ms: a response before its cause. ", axis_list(axes), several ? "lead" : "leads", ms(-lag_s));
  if (several || !others_at_rest) {
    f.effects = {effect("rotor_speed_delay").id, effect("pose_delay").id};
    f.words +=
        "No load acts ahead of what makes it; the same lead on several axes means that rotor speeds are stamped later than the motion "
        "(rotor_speed_delay), or poses earlier (pose_delay).";
  } else {
    f.words += "The model drives this axis with a quantity that comes later than the true one.";
  }
  if (yaw && several) {
    f.effects.push_back(effect("rotor_inertia_reaction").id);
    f.words += " On torque z rotor_inertia_reaction may add to it.";
  }
  return f;
}

LagFinding following(const std::vector<std::size_t>& axes, double lag_s) {
  LagFinding f{LagVerdict::follows, axes, lag_s, {}, ""};
  f.effects = {effect("thrust_lag").id, effect("rotor_speed_delay").id, effect("pose_delay").id, effect("sensor_mount_compliance").id};
  f.words = fmt::format(
      "{} {} the model's by {} ms: air that takes time to answer (thrust_lag), rotor speeds stamped early (rotor_speed_delay), poses "
      "stamped late (pose_delay), or a sensor on a soft mount (sensor_mount_compliance).",
      axis_list(axes), axes.size() == 1 ? "follows" : "follow", ms(lag_s));
  return f;
}

std::vector<LagFinding> findings_of(const LagResult& result, const LagOptions& o) {
  std::vector<std::size_t> leads, follows, at_rest;
  for (const AxisLag& r : result.axis) {
    if (!r.known) continue;
    const bool gains = r.share - r.share_at_zero >= o.least_gain;
    if (gains && r.high_s < 0.0 && r.lag_s <= -o.least_s) {
      leads.push_back(r.axis);
    } else if (gains && r.low_s > 0.0 && r.lag_s >= o.least_s) {
      follows.push_back(r.axis);
    } else {
      at_rest.push_back(r.axis);
    }
  }
  const auto mean_lag = [&](const std::vector<std::size_t>& axes) {
    double sum = 0.0;
    for (const std::size_t a : axes) sum += result.axis[a].lag_s / static_cast<double>(axes.size());
    return sum;
  };
  std::vector<LagFinding> out;
  if (leads == std::vector<std::size_t>{5}) {
    out.push_back(leading_yaw(result.axis[5]));
  } else if (!leads.empty()) {
    out.push_back(leading(leads, mean_lag(leads), !at_rest.empty()));
  }
  if (!follows.empty()) out.push_back(following(follows, mean_lag(follows)));
  return out;
}

}  // namespace

LagResult lag_analysis(const Samples& samples, const Axes& model, const Axes& missing, const LagOptions& o) {
  LagResult out;
  const std::vector<SampleBlock> blocks = blocks_of(samples, o.block_s);
  double step_s = 0.0;
  for (const Piece& p : samples.pieces) step_s = std::max(step_s, p.step_s);
  if (blocks.size() < 5 || !(step_s > 0.0)) return out;
  const int reach = static_cast<int>(std::round(o.range_s / step_s));
  for (std::size_t a = 0; a < kAxes; ++a) {
    std::vector<double> measured(samples.size);
    for (std::size_t i = 0; i < samples.size; ++i) measured[i] = model[a][i] + missing[a][i];
    const std::vector<double> x = detrended(samples, model[a], o.detrend_s), y = detrended(samples, measured, o.detrend_s);
    out.axis[a] = lag_of(a, correlate(samples, blocks, x, y, reach), reach, step_s, o);
  }
  out.findings = findings_of(out, o);
  return out;
}

}  // namespace rotorloop::diagnose
