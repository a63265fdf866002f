// Mean, spread and the largest distance from a uniform distribution: the measured side of each promise of a sensor.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace rotorloop::sim::test {

inline double mean(const std::vector<double>& x) {
  double s = 0.0;
  for (double v : x) s += v;
  return s / static_cast<double>(x.size());
}
inline double deviation(const std::vector<double>& x) {
  const double m = mean(x);
  double s = 0.0;
  for (double v : x) s += (v - m) * (v - m);
  return std::sqrt(s / static_cast<double>(x.size()));
}
inline double rms(const std::vector<double>& x) {
  double s = 0.0;
  for (double v : x) s += v * v;
  return std::sqrt(s / static_cast<double>(x.size()));
}
// Correlation of a zero-mean series with itself `lag` samples later.
inline double correlation(const std::vector<double>& x, std::size_t lag) {
  double a = 0.0, b = 0.0;
  for (std::size_t i = 0; i + lag < x.size(); ++i) a += x[i] * x[i + lag];
  for (std::size_t i = 0; i + lag < x.size(); ++i) b += x[i] * x[i];
  return a / b;
}
// Kolmogorov-Smirnov distance from the uniform distribution over [low, high].
inline double distance_from_uniform(std::vector<double> x, double low, double high) {
  std::sort(x.begin(), x.end());
  double worst = 0.0;
  const auto n = static_cast<double>(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double expected = (x[i] - low) / (high - low);
    worst = std::max({worst, std::fabs(expected - static_cast<double>(i) / n), std::fabs(expected - static_cast<double>(i + 1) / n)});
  }
  return worst;
}

}  // namespace rotorloop::sim::test
