#include "bench/stand/evaluate/estimate/variance_components.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "host/base/statistics.hpp"

namespace rotorloop::stand {
namespace {

// x with upper tail `p`, by halving: tails fall.
double inverse_tail(double p, const std::function<double(double)>& tail) {
  double low = 0.0, high = 1.0;
  while (tail(high) > p && high < 1e12) high *= 2.0;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (tail(middle) > p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}
double chi_square_value(double upper_tail, double degrees) {
  return inverse_tail(upper_tail, [&](double x) { return chi_square_tail(x, degrees); });
}
double f_value(double upper_tail, double d1, double d2) {
  return inverse_tail(upper_tail, [&](double x) { return f_tail(x, d1, d2); });
}

struct MeanSquare {
  double value = 0.0, degrees = 0.0;
};

// Of (upper - lower)/n: with F quantiles, after Williams (1962) and Tukey (1951); exact for lower = 0.
VarianceComponent component(const std::string& name, MeanSquare upper, MeanSquare lower, double n) {
  VarianceComponent c{name, 0.0, 0.0, std::numeric_limits<double>::infinity(), upper.degrees, upper.value};
  if (!(upper.degrees > 0.0)) return c;
  c.deviation = std::sqrt(std::max(0.0, (upper.value - lower.value) / n));
  const double chi_high = chi_square_value(0.025, upper.degrees), chi_low = chi_square_value(0.975, upper.degrees);
  const bool alone = !(lower.degrees > 0.0);
  const double f_high = alone ? 0.0 : f_value(0.025, upper.degrees, lower.degrees),
               f_low = alone ? 0.0 : f_value(0.975, upper.degrees, lower.degrees);
  c.low = std::sqrt(std::max(0.0, upper.degrees * (upper.value - f_high * lower.value) / (n * chi_high)));
  c.high = std::sqrt(std::max(0.0, upper.degrees * (upper.value - f_low * lower.value) / (n * chi_low)));
  return c;
}

}  // namespace

VarianceComponents variance_components(const std::vector<LabelledValue>& values) {
  VarianceComponents out;
  out.values = values.size();
  std::map<std::string, std::map<std::string, std::vector<double>>> groups;
  double mean = 0.0;
  for (const LabelledValue& v : values) {
    groups[v.propeller][v.mount].push_back(std::log(v.value));
    mean += std::log(v.value);
  }
  mean /= static_cast<double>(std::max<std::size_t>(1, values.size()));
  out.mean = std::exp(mean);
  out.propellers = groups.size();
  const double N = static_cast<double>(values.size());
  double ss_propeller = 0.0, ss_mount = 0.0, ss_repeat = 0.0;
  double squares_of_propellers = 0.0, squares_of_mounts = 0.0, squares_within = 0.0;  // Σ n², Σ n_ij², Σ_i Σ_j n_ij²/n_i
  for (const auto& [name, mounts] : groups) {
    double n = 0.0, sum = 0.0, squares = 0.0;
    out.mounts += mounts.size();
    for (const auto& [mount, repeats] : mounts)
      for (const double v : repeats) {
        n += 1.0;
        sum += v;
      }
    const double middle = sum / n;
    for (const auto& [mount, repeats] : mounts) {
      const double m = static_cast<double>(repeats.size());
      double of_mount = 0.0;
      for (const double v : repeats) of_mount += v / m;
      ss_mount += m * (of_mount - middle) * (of_mount - middle);
      for (const double v : repeats) ss_repeat += (v - of_mount) * (v - of_mount);
      squares += m * m;
    }
    ss_propeller += n * (middle - mean) * (middle - mean);
    squares_of_propellers += n * n;
    squares_of_mounts += squares;
    squares_within += squares / n;
  }
  const double a = static_cast<double>(out.propellers), b = static_cast<double>(out.mounts);
  const MeanSquare propeller{a > 1.0 ? ss_propeller / (a - 1.0) : 0.0, a - 1.0}, mount{b > a ? ss_mount / (b - a) : 0.0, b - a},
      repeat{N > b ? ss_repeat / (N - b) : 0.0, N - b};
  const double per_mount = (N - squares_within) / std::max(1.0, b - a);
  const double per_propeller = (N - squares_of_propellers / N) / std::max(1.0, a - 1.0);
  if (a > 1.0) out.components.push_back(component("between propellers", propeller, b > a ? mount : repeat, per_propeller));
  if (b > a) out.components.push_back(component("between mounts", mount, repeat, per_mount));
  if (N > b) out.components.push_back(component("between repeats", repeat, {}, 1.0));
  return out;
}

}  // namespace rotorloop::stand
