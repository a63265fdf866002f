#include "bench/sysid/identify/whiteness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/statistics.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kLags_s[] = {0.1, 0.5, 2.0};
constexpr double kWhitenessLevel = 0.01;  // of all tests of a flight together (Bonferroni)
constexpr double kSettling_s = 1.0;
constexpr const char* kChannels[] = {"x", "y", "z", "roll", "pitch", "yaw"};

}  // namespace

std::vector<double> autocorrelation(std::span<const double> s, std::size_t max_lag) {
  double mean = 0.0, n = 0.0;
  for (const double v : s) {
    if (std::isfinite(v)) {
      mean += v;
      n += 1.0;
    }
  }
  std::vector<double> out(max_lag + 1, 0.0);
  if (n < 2.0) return out;
  mean /= n;
  std::vector<double> c(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) c[i] = std::isfinite(s[i]) ? s[i] - mean : 0.0;  // a gap adds nothing
  for (std::size_t lag = 0; lag <= max_lag && lag < s.size(); ++lag) {
    double sum = 0.0;
    for (std::size_t i = lag; i < s.size(); ++i) sum += c[i] * c[i - lag];
    out[lag] = sum;
  }
  if (const double variance = out[0]; variance > 0.0) {
    for (double& r : out) r /= variance;
  }
  return out;
}

PortmanteauTest ljung_box(std::span<const double> s, std::size_t lags) {
  double n = 0.0;
  for (const double v : s) n += std::isfinite(v);
  PortmanteauTest t;
  t.lags = std::min<std::size_t>(lags, static_cast<std::size_t>(n / 4.0));
  const auto r = autocorrelation(s, t.lags);
  double used = 0.0;
  for (std::size_t k = 1; k <= t.lags; ++k) {
    // With gaps a lag has fewer pairs than n - k: its correlation is the sum over those pairs, not shrunk by the missing ones.
    double pairs = 0.0;
    for (std::size_t i = k; i < s.size(); ++i) pairs += std::isfinite(s[i]) && std::isfinite(s[i - k]);
    if (pairs < 1.0) continue;
    const double full = r[k] * (n - static_cast<double>(k)) / pairs;
    t.q += n * (n + 2.0) * full * full * pairs / ((n - static_cast<double>(k)) * (n - static_cast<double>(k)));
    used += 1.0;
  }
  if (used > 0.0) t.p = chi_square_tail(t.q, used);
  return t;
}

RunsTest runs_test(std::span<const double> s) {
  std::vector<double> v;
  for (const double x : s) {
    if (std::isfinite(x)) v.push_back(x);
  }
  RunsTest t;
  if (v.size() < 20) return t;
  const double middle = median(v);
  double above = 0.0, below = 0.0;
  int last = 0;
  for (const double x : v) {
    if (x == middle) continue;
    const int side = x > middle ? 1 : -1;
    (side > 0 ? above : below) += 1.0;
    t.runs += side != last;
    last = side;
  }
  const double n = above + below, product = 2.0 * above * below;
  if (above < 1.0 || below < 1.0) return t;
  const double mean = product / n + 1.0, variance = product * (product - n) / (n * n * (n - 1.0));
  t.z = variance > 0.0 ? (static_cast<double>(t.runs) - mean) / std::sqrt(variance) : 0.0;
  t.p = normal_two_sided(t.z);
  return t;
}

bool FlightWhiteness::white() const {
  return std::all_of(channels.begin(), channels.end(), [](const ChannelWhiteness& c) { return c.white; });
}

FlightWhiteness whiteness_of(const std::string& flight, std::span<const estimate::Innovation> all) {
  std::vector<double> t_s;
  for (const estimate::Innovation& i : all) t_s.push_back(i.t_s);
  FlightWhiteness out{.flight = flight, .step_s = median_step(t_s), .channels = {}, .second_s = {}, .cost_per_number = {}};
  std::size_t first = 0;
  while (first < all.size() && all[first].t_s < all.front().t_s + kSettling_s) ++first;
  const auto in = all.subspan(first);
  if (in.size() < 50 || out.step_s <= 0.0) return out;
  // Gaps become not-a-number, so that a lag is a time.
  std::vector<std::size_t> place;
  for (const estimate::Innovation& i : in)
    place.push_back(static_cast<std::size_t>(std::max(0.0, std::round((i.t_s - in.front().t_s) / out.step_s))));
  const auto lags_of = [&](double s) { return std::max<std::size_t>(1, static_cast<std::size_t>(std::round(s / out.step_s))); };
  const double tests = 6.0 * 4.0;
  for (Eigen::Index c = 0; c < 6; ++c) {
    ChannelWhiteness w;
    w.channel = kChannels[c];
    std::vector<double> series(place.back() + 1, std::numeric_limits<double>::quiet_NaN());
    double squares = 0.0;
    for (std::size_t i = 0; i < in.size(); ++i) {
      series[place[i]] = in[i].value[c];
      squares += in[i].value[c] * in[i].value[c];
    }
    w.rms = std::sqrt(squares / static_cast<double>(in.size()));
    w.correlation = autocorrelation(series, std::min(lags_of(kLags_s[2]), series.size() - 1));
    for (std::size_t k = 0; k < w.correlation.size(); ++k) w.lag_s.push_back(static_cast<double>(k) * out.step_s);
    for (const double lag : kLags_s) w.ljung_box.push_back(ljung_box(series, lags_of(lag)));
    w.runs = runs_test(series);
    w.white = w.runs.p >= kWhitenessLevel / tests;
    for (const PortmanteauTest& t : w.ljung_box) w.white = w.white && t.p >= kWhitenessLevel / tests;
    out.channels.push_back(std::move(w));
  }
  double sum = 0.0, n = 0.0, second = std::floor(in.front().t_s);
  const auto close = [&] {
    if (n > 0.0) {
      out.second_s.push_back(second);
      out.cost_per_number.push_back(sum / n);
    }
    sum = n = 0.0;
  };
  for (const estimate::Innovation& i : in) {
    if (std::floor(i.t_s) != second) {
      close();
      second = std::floor(i.t_s);
    }
    sum += i.value.squaredNorm();
    n += 6.0;
  }
  close();
  return out;
}

}  // namespace rotorloop::identify
