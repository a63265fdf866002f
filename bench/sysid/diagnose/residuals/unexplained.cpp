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

// Of a flight: the median over all flights, or its own where that is larger. A flight that lacks more throughout has no bursts.
double usual_rms(const Samples& samples, const std::vector<double>& power, std::size_t flight) {
  std::vector<double> own;
  for (const Piece& p : samples.pieces) {
    const auto first = power.begin() + static_cast<std::ptrdiff_t>(p.first);
    if (p.flight == flight) own.insert(own.end(), first, first + static_cast<std::ptrdiff_t>(p.count));
  }
  return std::sqrt(std::max(quantile(power, 0.5), quantile(std::move(own), 0.5)));
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
  for (const Piece& p : samples.pieces) {
    const double usual = usual_rms(samples, power, p.flight);
    if (!(usual > 0.0)) continue;
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

namespace {

// Share of the residual's power in the bursts, in samples first … first + count - 1, and what it makes of the rms.
void add_burst_power(const Samples& samples, const std::vector<double>& v, std::span<const Burst> found, std::size_t axis,
                     std::size_t first, std::size_t count, AxisUnexplained& x) {
  double in_bursts = 0.0;
  for (const Burst& b : found) {
    if (b.axis != axis) continue;
    for (const Piece& p : samples.pieces) {
      if (p.flight != b.flight || p.first < first || p.first >= first + count) continue;
      for (std::size_t i = 0; i < p.count; ++i) {
        const double t = p.start_s + static_cast<double>(i) * p.step_s;
        if (t >= b.from_s && t < b.to_s) in_bursts += v[p.first + i] * v[p.first + i];
      }
    }
  }
  const double power = x.rms * x.rms * static_cast<double>(count);
  x.burst_share = power > 0.0 ? in_bursts / power : 0.0;
  x.burst_rms = count > 0 ? std::sqrt(in_bursts / static_cast<double>(count)) : 0.0;
}

ResidualKind kind_of(const AxisUnexplained& x, bool known_noise, const Criteria& criteria) {
  const bool real = !known_noise || x.rms > 1.15 * x.rms_expected;
  if (x.explainable.share > criteria.negligible && x.explainable_by_chance < criteria.larger_part * x.explainable.share)
    return ResidualKind::systematic;
  return x.burst_share > criteria.larger_part ? ResidualKind::bursts : real ? ResidualKind::stochastic : ResidualKind::none;
}

// Size, noise, and what the inputs predict of it. `fits`: of the residual's axes, then of those of the first simulated ones.
std::array<AxisUnexplained, kAxes> sizes(const Axes& residual, std::span<const Axes> expected, std::vector<AdditiveFit> fits) {
  std::array<AxisUnexplained, kAxes> out;
  for (std::size_t a = 0; a < kAxes; ++a) {
    AxisUnexplained& x = out[a];
    x.rms = std::sqrt(mean_square(residual[a]));
    for (const Axes& e : expected) x.rms_expected += mean_square(e[a]) / static_cast<double>(expected.size());
    x.rms_expected = std::sqrt(x.rms_expected);
    for (std::size_t n = a + kAxes; n < fits.size(); n += kAxes) x.explainable_by_chance = std::max(x.explainable_by_chance, fits[n].share);
    x.explainable = std::move(fits[a]);
  }
  return out;
}

std::vector<const std::vector<double>*> series_of(const Axes& residual, std::span<const Axes> expected) {
  std::vector<const std::vector<double>*> out;
  for (const auto& a : residual) out.push_back(&a);
  for (const Axes& e : expected.first(std::min(kChanceFits, expected.size()))) {
    for (const auto& a : e) out.push_back(&a);
  }
  return out;
}

std::vector<double> cut(const std::vector<double>& v, std::size_t first, std::size_t count) {
  const auto from = v.begin() + static_cast<std::ptrdiff_t>(first);
  return {from, from + static_cast<std::ptrdiff_t>(count)};
}
Axes cut(const Axes& axes, std::size_t first, std::size_t count) {
  Axes out;
  for (std::size_t a = 0; a < kAxes; ++a) out[a] = cut(axes[a], first, count);
  return out;
}

// Flight by flight, each predicted from runs of blocks of its own.
std::vector<FlightUnexplained> by_flight(const Samples& samples, const Axes& residual, std::span<const Axes> expected,
                                         std::span<const Channel> used, std::span<const Burst> found, const UnexplainedOptions& o) {
  std::vector<FlightUnexplained> out;
  for (std::size_t f = 0; f < samples.flights.size(); ++f) {
    Samples own;
    own.flights = {samples.flights[f]};
    std::size_t first = samples.size;
    for (const Piece& p : samples.pieces) {
      if (p.flight != f) continue;
      first = std::min(first, p.first);
      own.add(0, p.start_s, p.step_s, p.count);
    }
    if (own.size == 0) continue;
    std::vector<Axes> noise;
    for (const Axes& e : expected) noise.push_back(cut(e, first, own.size));
    std::vector<Channel> inputs;
    for (const Channel& c : used) inputs.push_back({c.id, c.name, c.unit, cut(c.value, first, own.size), c.product});
    AdditiveOptions fit = o.fit;
    fit.left_out = LeftOut::runs;
    const Axes rest = cut(residual, first, own.size);
    FlightUnexplained x{.flight = f, .axis = sizes(rest, noise, additive_fit(own, series_of(rest, noise), inputs, 0, fit)), .kind = {}};
    for (std::size_t a = 0; a < kAxes; ++a) {
      add_burst_power(samples, residual[a], found, a, first, own.size, x.axis[a]);
      x.kind[a] = kind_of(x.axis[a], !expected.empty(), o.criteria);
    }
    out.push_back(std::move(x));
  }
  return out;
}

const Channel* input_named(std::span<const Channel> inputs, std::string_view id) {
  const auto at = std::find_if(inputs.begin(), inputs.end(), [&](const Channel& c) { return c.id == id; });
  return at == inputs.end() ? nullptr : &*at;
}

void add_places(const Samples& samples, std::span<const Channel> inputs, std::vector<Burst>& found) {
  const Channel *x = input_named(inputs, "place_x"), *y = input_named(inputs, "place_y"), *z = input_named(inputs, "height");
  if (!x || !y || !z) return;
  for (Burst& b : found) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double n = 0.0;
    for (const Piece& p : samples.pieces) {
      if (p.flight != b.flight) continue;
      for (std::size_t i = 0; i < p.count; ++i) {
        const double t = p.start_s + static_cast<double>(i) * p.step_s;
        if (t < b.from_s || t >= b.to_s) continue;
        sum += Eigen::Vector3d(x->value[p.first + i], y->value[p.first + i], z->value[p.first + i]);
        n += 1.0;
      }
    }
    if (n > 0.0) b.place_W_m = sum / n;
  }
}

}  // namespace

UnexplainedResult unexplained(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                              const UnexplainedOptions& o) {
  UnexplainedResult out;
  out.burst_window_s = o.burst_window_s;
  if (samples.size == 0) return out;
  std::vector<Channel> used;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    if (!inputs[i].product && std::find(std::begin(kExplaining), std::end(kExplaining), inputs[i].id) == std::end(kExplaining)) continue;
    used.push_back(inputs[i]);
    index.push_back(i);
  }
  out.axis = sizes(residual, expected, predicted_either_way(samples, series_of(residual, expected), used, o.fit));
  for (std::size_t a = 0; a < kAxes; ++a) {
    std::vector<double> ratios;
    for (const Axes& e : expected) ratios.push_back(largest_ratio(samples, e[a], o.burst_window_s));
    out.burst_limit[a] = std::max(o.criteria.fewest_u, quantile(ratios, 1.0 - o.criteria.chance));
    const std::vector<Burst> found = bursts(samples, residual[a], a, o.burst_window_s, out.burst_limit[a]);
    out.bursts.insert(out.bursts.end(), found.begin(), found.end());
  }
  std::stable_sort(out.bursts.begin(), out.bursts.end(),
                   [](const Burst& p, const Burst& q) { return p.flight != q.flight ? p.flight < q.flight : p.from_s < q.from_s; });
  add_places(samples, inputs, out.bursts);
  for (std::size_t a = 0; a < kAxes; ++a) {
    AxisUnexplained& x = out.axis[a];
    for (PartialCurve& c : x.explainable.curves) c.input = index[c.input];
    add_burst_power(samples, residual[a], out.bursts, a, 0, samples.size, x);
    out.kind[a] = kind_of(x, !expected.empty(), o.criteria);
  }
  if (samples.flights.size() > 1) out.flights = by_flight(samples, residual, expected, used, out.bursts, o);
  return out;
}

}  // namespace rotorloop::diagnose
