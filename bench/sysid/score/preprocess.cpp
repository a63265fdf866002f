#include "bench/sysid/score/preprocess.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/error.hpp"

namespace rotorloop::score {
namespace {

// One section of second order, y = b0 x + b1 x' + b2 x'' - a1 y' - a2 y'', in transposed form with two memories.
struct Section {
  double b0, b1, b2, a1, a2;

  // Starts as if the first value had been there for ever: gain 1 at zero frequency.
  void run(std::vector<double>& x) const {
    double z1 = x.front() * (1.0 - b0), z2 = x.front() * (b2 - a2);
    for (double& v : x) {
      const double y = b0 * v + z1;
      z1 = b1 * v - a1 * y + z2;
      z2 = b2 * v - a2 * y;
      v = y;
    }
  }
};

// Pairs of conjugate poles of the Butterworth filter, by the bilinear transform with the cut-off kept in place.
std::vector<Section> butterworth(double cutoff_Hz, double rate_Hz, int order) {
  const double k = std::tan(std::numbers::pi * cutoff_Hz / rate_Hz);
  std::vector<Section> sections;
  for (int i = 0; i < order / 2; ++i) {
    const double damping = 2.0 * std::sin(std::numbers::pi * (2.0 * i + 1.0) / (2.0 * order));  // of s^2 + damping s + 1
    const double a0 = 1.0 + damping * k + k * k;
    sections.push_back({k * k / a0, 2.0 * k * k / a0, k * k / a0, 2.0 * (k * k - 1.0) / a0, (1.0 - damping * k + k * k) / a0});
  }
  return sections;
}

}  // namespace

std::vector<double> zero_phase_low_pass(std::span<const double> x, double cutoff_Hz, double rate_Hz, int order) {
  if (!(cutoff_Hz > 0.0) || !(cutoff_Hz < 0.5 * rate_Hz) || order < 2 || order % 2 != 0) {
    throw Error({.where = "low-pass",
                 .what = fmt::format("cut-off {} Hz and order {} at {} Hz; allowed: 0 to {} Hz, an even order", cutoff_Hz, order, rate_Hz,
                                     0.5 * rate_Hz),
                 .likely = "",
                 .remedy = "lower the cut-off below half the sampling rate"});
  }
  if (x.size() < 2) return {x.begin(), x.end()};
  const std::size_t n = x.size(), pad = std::min<std::size_t>(n - 1, 3 * (static_cast<std::size_t>(order) + 1));
  std::vector<double> y(n + 2 * pad);
  for (std::size_t k = 0; k < pad; ++k) {
    y[k] = 2.0 * x[0] - x[pad - k];
    y[pad + n + k] = 2.0 * x[n - 1] - x[n - 2 - k];
  }
  std::copy(x.begin(), x.end(), y.begin() + static_cast<std::ptrdiff_t>(pad));
  const std::vector<Section> sections = butterworth(cutoff_Hz, rate_Hz, order);
  for (int pass = 0; pass < 2; ++pass) {
    for (const Section& s : sections) s.run(y);
    std::reverse(y.begin(), y.end());
  }
  return {y.begin() + static_cast<std::ptrdiff_t>(pad), y.begin() + static_cast<std::ptrdiff_t>(pad + n)};
}

std::size_t bridge_spikes(std::span<double> x, double largest, double largest_jump, std::size_t longest) {
  const std::size_t n = x.size();
  std::vector<bool> good(n, false);
  std::size_t last = n;
  for (std::size_t k = 0; k < n; ++k) {
    if (!std::isfinite(x[k]) || std::fabs(x[k]) > largest) continue;
    if (last != n && std::fabs(x[k] - x[last]) > largest_jump && k - last <= longest) continue;
    good[k] = true;
    last = k;
  }
  if (last == n) return 0;
  std::size_t replaced = 0, before = n;
  for (std::size_t k = 0; k < n; ++k) {
    if (good[k]) {
      before = k;
      continue;
    }
    std::size_t after = k;
    while (after < n && !good[after]) ++after;
    ++replaced;
    if (before == n) {
      x[k] = x[after];
    } else if (after == n) {
      x[k] = x[before];
    } else {
      const double a = static_cast<double>(k - before) / static_cast<double>(after - before);
      x[k] = x[before] + a * (x[after] - x[before]);
    }
  }
  return replaced;
}

}  // namespace rotorloop::score
