#include "bench/sysid/diagnose/residuals/samples.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::diagnose {

std::vector<SampleBlock> blocks_of(const Samples& samples, double block_s) {
  std::vector<SampleBlock> out;
  for (const Piece& p : samples.pieces) {
    if (p.count == 0) continue;
    const double length_s = static_cast<double>(p.count) * p.step_s;
    const auto n = static_cast<std::size_t>(std::max(1.0, std::round(length_s / block_s)));
    for (std::size_t b = 0; b < n; ++b) {
      const std::size_t from = p.count * b / n, to = p.count * (b + 1) / n;
      if (to > from) out.push_back({p.flight, p.first + from, to - from});
    }
  }
  return out;
}

std::vector<int> folds_of(const Samples& samples, std::span<const SampleBlock> blocks, int folds, LeftOut left_out) {
  std::vector<int> out;
  const bool whole_flights = left_out == LeftOut::flights && samples.flights.size() >= 3;
  // Runs long enough that what is left out has few neighbours in what is kept.
  const std::size_t run = std::max<std::size_t>(1, blocks.size() / static_cast<std::size_t>(2 * folds));
  for (std::size_t b = 0; b < blocks.size(); ++b)
    out.push_back(whole_flights ? static_cast<int>(blocks[b].flight) : static_cast<int>(b / run) % folds);
  return out;
}

std::vector<double> times_s(const Samples& samples) {
  std::vector<double> t(samples.size);
  for (const Piece& p : samples.pieces) {
    for (std::size_t i = 0; i < p.count; ++i) t[p.first + i] = p.start_s + static_cast<double>(i) * p.step_s;
  }
  return t;
}

double mean_square(std::span<const double> v) {
  double sum = 0.0;
  for (const double x : v) sum += x * x;
  return v.empty() ? 0.0 : sum / static_cast<double>(v.size());
}

std::vector<double> sliding_mean(const Samples& samples, std::span<const double> v, double window_s) {
  std::vector<double> out(v.size());
  for (const Piece& p : samples.pieces) {
    const auto half = static_cast<std::size_t>(std::max(1.0, std::round(0.5 * window_s / p.step_s)));
    std::vector<double> sum(p.count + 1, 0.0);
    for (std::size_t i = 0; i < p.count; ++i) sum[i + 1] = sum[i] + v[p.first + i];
    for (std::size_t i = 0; i < p.count; ++i) {
      const std::size_t from = i > half ? i - half : 0, to = std::min(p.count, i + half + 1);
      out[p.first + i] = (sum[to] - sum[from]) / static_cast<double>(to - from);
    }
  }
  return out;
}

}  // namespace rotorloop::diagnose
