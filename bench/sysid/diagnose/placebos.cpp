#include "bench/sysid/diagnose/placebos.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "host/base/random.hpp"

namespace rotorloop::diagnose {
namespace {

using Index = ScoreTable::Index;

constexpr std::uint64_t kPlaceboStream = 0xD1A6;
constexpr std::size_t kWrenchRows = 6;
// Of a column's root mean square, N and N m alike, that must be left without its mean. Rounding leaves 1e-16; effects that depend on the
// motion at all vary by some per cent.
constexpr double kLeft = 1e-3;

// The largest product of 2, 3 and 5 that is at most n: transforms of other lengths are slow.
std::size_t smooth_length(std::size_t n) {
  for (std::size_t m = n; m > 1; --m) {
    std::size_t rest = m;
    for (const std::size_t factor : {2u, 3u, 5u}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return m;
  }
  return n;
}

// A row of numbers with the phases of its spectrum turned by `turn` (one angle for each frequency, the same for all rows).
void turn_phases(std::vector<double>& row, const std::vector<double>& turn, Eigen::FFT<double>& fft) {
  std::vector<std::complex<double>> spectrum;
  fft.fwd(spectrum, row);
  const std::size_t n = row.size();
  for (std::size_t k = 1; k < (n + 1) / 2; ++k) {
    spectrum[k] *= std::polar(1.0, turn[k]);
    spectrum[n - k] = std::conj(spectrum[k]);
  }
  fft.inv(row, spectrum);
}

// One axis of one column of a flight, and its mean.
struct Row {
  std::vector<double> value;
  double mean = 0.0;
};
Row row_of(const estimate::ExtraColumns& real, std::size_t column, std::size_t axis) {
  const std::size_t every = kWrenchRows * static_cast<std::size_t>(real.count), steps = real.wrench.size() / every;
  Row out{std::vector<double>(steps), 0.0};
  for (std::size_t k = 0; k < steps; ++k) {
    out.value[k] = real.wrench[k * every + column * kWrenchRows + axis];
    out.mean += out.value[k] / static_cast<double>(steps);
  }
  return out;
}

bool varies(std::span<const estimate::ExtraColumns> real, std::size_t column) {
  double left = 0.0, all = 0.0;
  for (const estimate::ExtraColumns& flight : real) {
    for (std::size_t axis = 0; axis < kWrenchRows; ++axis) {
      const Row row = row_of(flight, column, axis);
      for (const double v : row.value) {
        all += v * v;
        left += (v - row.mean) * (v - row.mean);
      }
    }
  }
  return left > kLeft * kLeft * all;
}

// `of`: the column that each placebo copies.
estimate::ExtraColumns disguised(const estimate::ExtraColumns& real, const std::vector<std::size_t>& of, double step_s,
                                 const RandomStream& random) {
  const std::size_t wide = kWrenchRows * of.size(), steps = real.wrench.size() / (kWrenchRows * static_cast<std::size_t>(real.count));
  const auto shortest = static_cast<std::size_t>(2.0 / step_s);
  const std::size_t turned = smooth_length(steps);  // a few steps at the end stay as they are
  estimate::ExtraColumns out;
  out.count = static_cast<Index>(of.size());
  out.wrench.assign(steps * wide, 0.0);
  Eigen::FFT<double> fft;
  std::vector<double> head(turned), turn(steps);
  std::uint64_t sample = 0;
  for (std::size_t c = 0; c < of.size(); ++c) {
    for (double& a : turn) a = 2.0 * std::numbers::pi * random.uniform(sample++);
    const double share = random.uniform(sample++);
    const bool shifted = c % 4 == 3 && steps > 3 * shortest;
    for (std::size_t axis = 0; axis < kWrenchRows; ++axis) {
      auto [row, mean] = row_of(real, of[c], axis);
      for (double& v : row) v -= mean;
      if (shifted) {
        const auto shift = shortest + static_cast<std::size_t>(share * static_cast<double>(steps - 2 * shortest));
        std::rotate(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(shift), row.end());
      } else {
        head.assign(row.begin(), row.begin() + static_cast<std::ptrdiff_t>(turned));
        turn_phases(head, turn, fft);
        std::copy(head.begin(), head.end(), row.begin());
      }
      for (std::size_t k = 0; k < steps; ++k) out.wrench[k * wide + c * kWrenchRows + axis] = row[k];
    }
  }
  return out;
}

}  // namespace

std::vector<estimate::ExtraColumns> placebo_columns(std::span<const estimate::ExtraColumns> real, const std::vector<double>& step_s,
                                                    std::size_t count, std::uint64_t seed) {
  std::vector<std::size_t> usable;
  for (std::size_t c = 0; c < static_cast<std::size_t>(real.front().count); ++c) {
    if (varies(real, c)) usable.push_back(c);
  }
  if (usable.empty() || count == 0) return {};
  std::vector<std::size_t> of(count);
  for (std::size_t c = 0; c < count; ++c) of[c] = usable[(c * 7919) % usable.size()];  // every candidate has its turn
  std::vector<estimate::ExtraColumns> out;
  for (std::size_t f = 0; f < real.size(); ++f) out.push_back(disguised(real[f], of, step_s[f], RandomStream(seed, kPlaceboStream + f)));
  return out;
}

std::vector<double> placebo_statistics(const identify::Identification& r, const Screening& screening, std::size_t count, std::uint64_t seed,
                                       double block_s, int threads, estimate::StopFit stop) {
  std::vector<double> step_s, out;
  for (const estimate::GridFlight* g : r.problem.flights) step_s.push_back(g->step_s);
  const std::vector<estimate::ExtraColumns> placebos = placebo_columns(screening.series, step_s, count, seed);
  if (placebos.empty()) return out;
  stop.check();
  const ScoreTable table = table_with(r, placebos, block_s, threads, stop);
  for (std::size_t c = 0; c < count; ++c) {
    const GroupTest t = test_group(table, base_columns(table), {table.base + static_cast<Index>(c)});
    if (t.degrees > 0) out.push_back(t.wald);
  }
  std::sort(out.begin(), out.end());
  return out;
}

PlaceboLimit placebo_limit(std::span<const double> statistics, double level) {
  const std::size_t n = statistics.size();
  if (n == 0) return {};
  const double of = static_cast<double>(n) + 1.0;
  const auto k = std::min(n, static_cast<std::size_t>(std::ceil(level * of - 1e-9)));
  return {statistics[std::max<std::size_t>(k, 1) - 1], static_cast<double>(k) / of, n};
}

std::string words(const PlaceboLimit& limit) {
  if (limit.placebos == 0) return "no placebos";
  return fmt::format("{} placebos, {:.1f} % of such columns below Wald F {:.1f}", limit.placebos, 100.0 * limit.level, limit.wald);
}

}  // namespace rotorloop::diagnose
