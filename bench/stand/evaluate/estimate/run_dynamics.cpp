#include "bench/stand/evaluate/estimate/run_dynamics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "host/base/block_fit.hpp"
#include "host/base/error.hpp"
#include "host/base/least_squares.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

constexpr double kStep = 0.03;        // of the speed: a smaller change of the target is no step
constexpr double kLongest_s = 1.0;    // of a step that is looked at
constexpr std::size_t kFewest = 8;    // samples of a step
constexpr std::size_t kSegments = 8;  // of a spectrum, half overlapping
constexpr double kAhead = 0.9;        // readings: a speed that begins to change so long before its target's first row is ahead of it

struct Transition {
  std::size_t from = 0, to = 0;  // samples; the target changes at `from`
  double before_rad_s = 0.0, after_rad_s = 0.0;
};

std::vector<Transition> transitions(const SampleSeries& s) {
  std::vector<Transition> out;
  for (std::size_t i = 1; i < s.t_s.size(); ++i) {
    const double a = s.target_rad_s[i - 1], b = s.target_rad_s[i];
    if (!(a > 0.0) || !(b > 0.0) || std::abs(b - a) < kStep * a) continue;
    std::size_t end = i;
    while (end < s.t_s.size() && s.target_rad_s[end] == b && s.t_s[end] - s.t_s[i] <= kLongest_s) ++end;
    if (end - i >= kFewest) out.push_back({i, end, s.omega_rad_s[i - 1], b});
    i = end - 1;
  }
  return out;
}

// ω(t) = after + (before - after) exp(-(t - delay)/τ) after the delay; levels from the samples themselves.
std::optional<TimeConstant> fit_lag(const SampleSeries& s, const Transition& t) {
  const double after = s.omega_rad_s[t.to - 1];
  if (std::abs(after - t.before_rad_s) < 0.5 * std::abs(t.after_rad_s - t.before_rad_s)) return std::nullopt;
  const auto residuals = [&](const std::vector<double>& v) {
    Eigen::VectorXd r(static_cast<Eigen::Index>(t.to - t.from));
    for (std::size_t i = t.from; i < t.to; ++i) {
      const double since = s.t_s[i] - s.t_s[t.from] - v[1];
      const double model = since <= 0.0 ? t.before_rad_s : v[2] + (t.before_rad_s - v[2]) * std::exp(-since / v[0]);
      r(static_cast<Eigen::Index>(i - t.from)) = (s.omega_rad_s[i] - model) / std::abs(after - t.before_rad_s);
    }
    return r;
  };
  // A lag of a few milliseconds is over within two readings. Where the delay passes a reading the sum of squares has a kink, and a minimum
  // on either side: the least from several starts is taken. The target may have changed up to one reading before the row that shows it
  // first, which bounds the delay.
  const double dt = median_step(s.t_s);
  std::optional<LeastSquaresFit> best;
  for (const double lag_s : {0.3 * dt, 4.0 * dt, 0.04})
    for (const double delay_s : {0.0, 0.5 * dt, 1.2 * dt}) try {
        LeastSquaresFit f = fit_least_squares({{"time constant", "s", std::clamp(lag_s, 1e-3, 2.0), 1e-3, 2.0, 1e-4},
                                               {"delay", "s", std::min(delay_s, 0.2), -dt, 0.2, 1e-4},
                                               {"level", "rad/s", after, 0.5 * after, 1.5 * after, 1e-2}},
                                              residuals);
        if (!best || f.rms < best->rms) best = std::move(f);
      } catch (const Error&) {
        return std::nullopt;  // readings that are not finite, from any start
      }
  if (best->at_bound[0]) return std::nullopt;
  return TimeConstant{best->values[0], best->standard_errors[0], best->values[1], 1};
}

// Standard uncertainties are told as if of many degrees of freedom: that of few blocks is made larger by so much.
double few_blocks(std::size_t blocks) {
  constexpr double kNormal = 1.96;
  return blocks > 1 ? student_quantile(0.95, static_cast<double>(blocks - 1)) / kNormal : 6.5;
}

std::optional<TimeConstant> pooled(const std::vector<TimeConstant>& all) {
  if (all.empty()) return std::nullopt;
  std::vector<double> tau, delay;
  for (const auto& t : all) {
    tau.push_back(t.value_s);
    delay.push_back(t.delay_s);
  }
  TimeConstant out{median(tau), 0.0, median(delay), all.size()};
  double mean = 0.0, squares = 0.0;
  for (const double t : tau) mean += t / static_cast<double>(tau.size());
  for (const double t : tau) squares += (t - mean) * (t - mean);
  // The deviation of a handful of values is far too small in some draws if it is the robust one, which outliers need where there are many.
  constexpr std::size_t kMany = 20;
  const double n = static_cast<double>(tau.size());
  const double deviation = tau.size() >= kMany ? robust_deviation(tau) : tau.size() > 1 ? std::sqrt(squares / (n - 1.0)) : 0.0;
  out.u_s = tau.size() > 1 ? 1.2533 * few_blocks(tau.size()) * deviation / std::sqrt(n) : few_blocks(1) * all[0].u_s;
  return out;
}

// Q = Σ_k h_k (J dω/dt + Q_static) (k intervals earlier) + constant, interval by interval: torque by the mean of its ends, as speed by
// their difference. An indicator's filter, readings between samples and clocks that differ smear the torque over neighbouring intervals by
// h; Σ h_k = 1, whatever its shape. One coefficient alone would lose what the smear takes: 29 % behind a filter of 4 ms and readings at 100
// Hz where the speed changes within two of them. The static torque goes through the same smear: 2 ms of it are 1 % of J. The constant takes
// up what the static fit left.
constexpr int kSmearBefore = 2, kSmearAfter = 4;  // intervals
constexpr int kTaps = kSmearBefore + kSmearAfter + 1;
using Smear = std::array<double, kTaps>;

struct InertiaRow {
  double torque_N_m = 0.0;
  Smear slope_rad_s2{}, static_N_m{};  // by k
  int block = 0;
};

std::vector<InertiaRow> inertia_rows(const SampleSeries& s, const std::vector<Transition>& all, const std::vector<double>& static_N_m,
                                     double offset) {
  std::vector<InertiaRow> out;
  for (std::size_t k = 0; k < all.size(); ++k)
    for (std::size_t i = std::max<std::size_t>(1 + kSmearAfter, all[k].from); i < all[k].to && i + kSmearBefore < s.t_s.size(); ++i) {
      if (!(s.omega_rad_s[i - 1] > 0.0) || !(s.omega_rad_s[i] > 0.0)) continue;
      InertiaRow row;
      row.torque_N_m = 0.5 * (s.torque_N_m[i] + s.torque_N_m[i - 1]) - offset;
      row.block = static_cast<int>(k);
      bool whole = std::isfinite(row.torque_N_m);
      for (int lag = -kSmearBefore; lag <= kSmearAfter; ++lag) {
        const auto j = static_cast<std::size_t>(static_cast<int>(i) - lag), tap = static_cast<std::size_t>(lag + kSmearBefore);
        row.slope_rad_s2[tap] = (s.omega_rad_s[j] - s.omega_rad_s[j - 1]) / (s.t_s[j] - s.t_s[j - 1]);
        row.static_N_m[tap] = 0.5 * (static_N_m[j] + static_N_m[j - 1]);
        whole = whole && std::isfinite(row.slope_rad_s2[tap]) && std::isfinite(row.static_N_m[tap]);
      }
      if (whole) out.push_back(row);
    }
  return out;
}

// J and its u for a given smear of the static torque; `smear` becomes the one that J shows.
BlockFit fit_inertia_once(const std::vector<InertiaRow>& rows, Smear& smear) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  // With differences from the first, its coefficient is the sum of all.
  Eigen::MatrixXd X(n, kTaps + 1);
  Eigen::VectorXd y(n);
  std::vector<int> block;
  for (Eigen::Index i = 0; i < n; ++i) {
    const InertiaRow& row = rows[static_cast<std::size_t>(i)];
    y(i) = row.torque_N_m;
    for (std::size_t k = 0; k < kTaps; ++k) y(i) -= smear[k] * row.static_N_m[k];
    X(i, 0) = row.slope_rad_s2[kSmearBefore];
    X(i, kTaps) = 1.0;
    for (Eigen::Index k = 1; k < kTaps; ++k)
      X(i, k) = row.slope_rad_s2[static_cast<std::size_t>(k <= kSmearBefore ? k - 1 : k)] - row.slope_rad_s2[kSmearBefore];
    block.push_back(row.block);
  }
  const BlockFit f = fit_in_blocks(X, y, block);
  double others = 0.0;
  for (Eigen::Index k = 1; k < kTaps; ++k) {
    smear[static_cast<std::size_t>(k <= kSmearBefore ? k - 1 : k)] = f.c(k) / f.c(0);
    others += f.c(k) / f.c(0);
  }
  smear[kSmearBefore] = 1.0 - others;
  return f;
}

// The share of the slopes' power that is noise: slopes where the speed has settled, in the last third of each transition, against all.
// Noise in what is regressed on makes J too small by just this share.
double noise_share(const std::vector<InertiaRow>& rows) {
  double all = 0.0, settled = 0.0;
  std::size_t settled_rows = 0;
  for (std::size_t first = 0; first < rows.size();) {
    std::size_t last = first;
    while (last < rows.size() && rows[last].block == rows[first].block) ++last;
    for (std::size_t i = first; i < last; ++i) {
      const double slope = rows[i].slope_rad_s2[kSmearBefore];
      all += slope * slope;
      if (3 * (i - first) >= 2 * (last - first)) {
        settled += slope * slope;
        ++settled_rows;
      }
    }
    first = last;
  }
  return all > 0.0 && settled_rows > 0 ? settled / static_cast<double>(settled_rows) / (all / static_cast<double>(rows.size())) : 1.0;
}

// What no step shows: gain of the torque cell, arm, alignment; the speed's clock enters as often as the slope.
double inertia_type_b(const StandUncertainty& k) {
  const double tilt = 0.5 * k.alignment_rad.u * k.alignment_rad.u;
  return std::sqrt(k.torque_calibration.u * k.torque_calibration.u + k.arm_length.u * k.arm_length.u + tilt * tilt +
                   k.rotor_speed.u * k.rotor_speed.u);
}

// Torque by the mean of an interval's ends is too large by x²/12 of an exponential, x = interval over time constant (Euler and Maclaurin).
double trapezoid_error(const RunDynamics& d, const SampleSeries& s) {
  double fastest_s = HUGE_VAL;
  for (const auto& t : {d.up, d.down})
    if (t) fastest_s = std::min(fastest_s, t->value_s);
  constexpr double kMost = 0.35;  // 1 %: what is faster is smeared by the instrument, which the fit takes up
  const double x = std::min(kMost, median_step(s.t_s) / fastest_s);
  return x * x / 12.0;
}

void fit_inertia(RunDynamics& out, const StandRun& run, const std::vector<Transition>& all, double c_q, double exponent, double centre,
                 double offset) {
  constexpr double kMostNoise = 0.02;  // J would be 2 % too small
  const SampleSeries& s = run.samples;
  constexpr int kRounds = 4;  // each changes J by a hundredth of the one before
  std::vector<double> static_N_m;
  for (const double w : s.omega_rad_s) static_N_m.push_back(c_q * w * w * std::pow(w / centre, exponent - 2.0));
  const std::vector<InertiaRow> rows = inertia_rows(s, all, static_N_m, offset);
  if (rows.size() < 30 || all.size() < 2) return;
  if (const double noise = noise_share(rows); noise > kMostNoise) {
    out.no_inertia =
        fmt::format("no J: {:.0f} % of the changes of speed are noise of the speed, allowed are {:g} %; the sequence steps shows it",
                    100.0 * noise, 100.0 * kMostNoise);
    return;
  }
  Smear smear{};
  smear[kSmearBefore] = 1.0;
  for (int round = 0; round < kRounds; ++round) {
    const BlockFit f = fit_inertia_once(rows, smear);
    out.inertia_kg_m2 = f.c(0);

    out.inertia_u_kg_m2 = std::hypot(few_blocks(f.blocks) * f.u(0), inertia_type_b(run.known) * f.c(0), trapezoid_error(out, s) * f.c(0));
  }
}

using Complex = std::complex<double>;

// Transfer function from target to speed at `f_Hz` with its coherence, over half-overlapping Hann windows (Welch 1967).
struct SpectralPoint {
  Complex gain;
  double coherence = 0.0;
};
SpectralPoint transfer(const std::vector<double>& x, const std::vector<double>& y, double dt, std::size_t length, double f_Hz) {
  Complex sxy = 0.0;
  double sxx = 0.0, syy = 0.0;
  for (std::size_t from = 0; from + length <= x.size(); from += length / 2) {
    double mx = 0.0, my = 0.0;
    for (std::size_t i = 0; i < length; ++i) {
      mx += x[from + i];
      my += y[from + i];
    }
    mx /= static_cast<double>(length);
    my /= static_cast<double>(length);
    Complex a = 0.0, b = 0.0;
    for (std::size_t i = 0; i < length; ++i) {
      const double hann = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(length));
      const Complex turn = std::polar(hann, -2.0 * std::numbers::pi * f_Hz * dt * static_cast<double>(i));
      a += turn * (x[from + i] - mx);
      b += turn * (y[from + i] - my);
    }
    sxy += std::conj(a) * b;
    sxx += std::norm(a);
    syy += std::norm(b);
  }
  if (!(sxx > 0.0) || !(syy > 0.0)) return {};
  return {sxy / sxx, std::norm(sxy) / (sxx * syy)};
}

// The longest stretch in which the target changes from sample to sample: a chirp or a pseudo-random sequence.
std::optional<Bandwidth> bandwidth(const SampleSeries& s) {
  const double dt = median_step(s.t_s);
  std::vector<double> x, y, best_x, best_y;
  std::size_t since = 0;
  for (std::size_t i = 1; i < s.t_s.size(); ++i) {
    const bool moves = s.target_rad_s[i] != s.target_rad_s[i - 1];
    since = moves ? 0 : since + 1;
    if (!(s.target_rad_s[i] > 0.0) || static_cast<double>(since) * dt > 0.5) {
      if (x.size() > best_x.size()) {
        best_x = x;
        best_y = y;
      }
      x.clear();
      y.clear();
      continue;
    }
    x.push_back(s.target_rad_s[i]);
    y.push_back(s.omega_rad_s[i]);
  }
  if (x.size() > best_x.size()) {
    best_x = x;
    best_y = y;
  }
  const std::size_t length = 2 * best_x.size() / (kSegments + 1);
  if (static_cast<double>(length) * dt < 0.5) return std::nullopt;
  Bandwidth out;
  const double low = 2.0 / (static_cast<double>(length) * dt), high = 0.45 / dt;
  double turned = 0.0, last = 0.0;
  for (double f = low; f < high; f *= 1.08) {
    const SpectralPoint p = transfer(best_x, best_y, dt, length, f);
    if (p.coherence < kCoherenceGate) {
      if (out.f_Hz.empty()) continue;
      break;  // beyond the first gap nothing can be joined
    }
    double phase = std::arg(p.gain) * 180.0 / std::numbers::pi;
    if (!out.f_Hz.empty()) turned += phase - last > 180.0 ? -360.0 : phase - last < -180.0 ? 360.0 : 0.0;
    last = phase;
    phase += turned;
    const double gain = 20.0 * std::log10(std::abs(p.gain));
    const auto crossed = [&](double now, double before, double level, double& at) {
      if (at == at || out.f_Hz.empty() || now > level || before <= level) return;
      at = out.f_Hz.back() * std::pow(f / out.f_Hz.back(), (before - level) / (before - now));
    };
    if (!out.f_Hz.empty()) {
      crossed(gain, out.gain_dB.back(), -3.0103, out.minus_3dB_Hz);
      crossed(phase, out.phase_deg.back(), -90.0, out.minus_90deg_Hz);
    }
    out.f_Hz.push_back(f);
    out.gain_dB.push_back(gain);
    out.phase_deg.push_back(phase);
    out.coherence.push_back(p.coherence);
  }
  if (out.f_Hz.size() < 4) return std::nullopt;
  out.from_Hz = out.f_Hz.front();
  out.to_Hz = out.f_Hz.back();
  return out;
}

}  // namespace

std::optional<RunDynamics> run_dynamics(const StandRun& run, std::optional<double> c_q, double exponent, double centre, double offset) {
  const SampleSeries& s = run.samples;
  if (s.empty() || std::none_of(s.target_rad_s.begin(), s.target_rad_s.end(), [](double v) { return v > 0.0; })) return std::nullopt;
  RunDynamics out;
  const auto all = transitions(s);
  std::vector<TimeConstant> up, down;
  std::size_t ahead = 0;
  for (const Transition& t : all)
    if (const auto lag = fit_lag(s, t)) {
      if (lag->delay_s < -kAhead * median_step(s.t_s))
        ++ahead;
      else
        (t.after_rad_s > t.before_rad_s ? up : down).push_back(*lag);
    }
  out.up = pooled(up);
  out.down = pooled(down);
  out.transitions = all.size();
  if (2 * ahead > all.size()) {
    out.up.reset();
    out.down.reset();
    out.no_lag = fmt::format(
        "no time constants: in {} of {} steps the speed changes before its target, which no loop does; likely: columns of two clocks, or a "
        "target that is written down late; give both by one clock",
        ahead, all.size());
  }
  if (c_q) fit_inertia(out, run, all, *c_q, exponent, centre, offset);
  out.bandwidth = bandwidth(s);
  if (!out.up && !out.down && !out.inertia_kg_m2 && !out.bandwidth && out.no_inertia.empty() && out.no_lag.empty()) return std::nullopt;
  return out;
}

}  // namespace rotorloop::stand
