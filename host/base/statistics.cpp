#include "host/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace rotorloop {
namespace {

// Continued fraction of the incomplete beta function (Abramowitz and Stegun 26.5.8), by Lentz's method.
double beta_fraction(double a, double b, double x) {
  constexpr double kTiny = 1e-300, kAccuracy = 1e-14;
  double c = 1.0, d = 1.0 - (a + b) * x / (a + 1.0);
  d = 1.0 / (std::fabs(d) < kTiny ? kTiny : d);
  double h = d;
  for (int m = 1; m < 500; ++m) {
    const auto turn = [&](double numerator) {
      d = 1.0 + numerator * d;
      c = 1.0 + numerator / c;
      d = 1.0 / (std::fabs(d) < kTiny ? kTiny : d);
      if (std::fabs(c) < kTiny) c = kTiny;
      h *= d * c;
    };
    const double n = m;
    turn(n * (b - n) * x / ((a + 2.0 * n - 1.0) * (a + 2.0 * n)));
    turn(-(a + n) * (a + b + n) * x / ((a + 2.0 * n) * (a + 2.0 * n + 1.0)));
    if (std::fabs(d * c - 1.0) < kAccuracy) break;
  }
  return h;
}

// Regularised incomplete beta function I_x(a, b).
double incomplete_beta(double a, double b, double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
  return x < (a + 1.0) / (a + b + 2.0) ? front * beta_fraction(a, b, x) / a : 1.0 - front * beta_fraction(b, a, 1.0 - x) / b;
}

// Regularised upper incomplete gamma function Q(a, x): series below a + 1, continued fraction above (Lentz).
double gamma_q(double a, double x) {
  if (x <= 0.0) return 1.0;
  const double front = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < 10000 && std::fabs(term) > 1e-16 * std::fabs(sum); ++n) sum += term *= x / (a + n);
    return std::max(0.0, 1.0 - front * sum);
  }
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a, c = 1.0 / kTiny, d = 1.0 / b, h = d;
  for (int n = 1; n < 10000; ++n) {
    const double an = -n * (n - a);
    b += 2.0;
    d = an * d + b;
    if (std::fabs(d) < kTiny) d = kTiny;
    c = b + an / c;
    if (std::fabs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    const double change = d * c;
    h *= change;
    if (std::fabs(change - 1.0) < 1e-15) break;
  }
  return front * h;
}

}  // namespace

double chi_square_tail(double x, double degrees) { return gamma_q(0.5 * degrees, 0.5 * x); }
double normal_two_sided(double z) { return std::erfc(std::fabs(z) / std::sqrt(2.0)); }
double f_tail(double x, double d1, double d2) { return x <= 0.0 ? 1.0 : incomplete_beta(0.5 * d2, 0.5 * d1, d2 / (d2 + d1 * x)); }

double student_quantile(double level, double degrees) {
  double low = 0.0, high = 1e6;  // beyond what one degree has at 1 - 1e-6; 60 halvings leave its rounding
  for (int i = 0; i < 60; ++i) {
    const double t = 0.5 * (low + high);
    (f_tail(t * t, 1.0, std::max(1.0, degrees)) > 1.0 - level ? low : high) = t;
  }
  return high;
}

double quantile(std::vector<double> v, double fraction) {
  if (v.empty()) return 0.0;
  const auto n = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(v.size() - 1) + 0.5);
  std::nth_element(v.begin(), v.begin() + n, v.end());
  return v[static_cast<std::size_t>(n)];
}

double median(std::vector<double> v) { return quantile(std::move(v), 0.5); }

double median_step(std::span<const double> t) {
  std::vector<double> d(t.empty() ? 0 : t.size() - 1);
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = t[i + 1] - t[i];
  return median(std::move(d));
}

double robust_deviation(const std::vector<double>& v) {
  const double middle = median(v);
  std::vector<double> d(v.size());
  for (std::size_t i = 0; i < v.size(); ++i) d[i] = std::fabs(v[i] - middle);
  return 1.4826 * median(std::move(d));  // 1 / Φ⁻¹(3/4)
}

std::vector<double> holm(std::span<const double> p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> out(p.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    largest = std::max(largest, std::min(1.0, p[order[i]] * static_cast<double>(p.size() - i)));
    out[order[i]] = largest;
  }
  return out;
}

}  // namespace rotorloop
