#include "bench/sysid/diagnose/residuals/dependence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "host/base/random.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::diagnose {
namespace {

constexpr std::uint64_t kDependenceBootstrap = 0x44455045u;
constexpr std::size_t kMapCells = 8;  // along the longer side
constexpr std::size_t kLeastBlocksOfSpread = 3;

// Which bin each sample is in, by equally filled bins.
struct Binned {
  std::vector<double> edges;
  std::vector<std::uint16_t> bin;
  bool usable = false;
};
Binned binned(const std::vector<double>& v, std::size_t bins) {
  Binned out;
  std::vector<double> sorted = v;
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty() || !(sorted.back() > sorted.front()) || !std::isfinite(sorted.back() - sorted.front())) return out;
  out.edges.push_back(sorted.front());
  for (std::size_t b = 1; b < bins; ++b) {
    const double e = sorted[sorted.size() * b / bins];
    if (e > out.edges.back()) out.edges.push_back(e);
  }
  out.edges.push_back(sorted.back());
  if (out.edges.size() < 3) return out;
  for (const double x : v) {
    const auto at = std::upper_bound(out.edges.begin() + 1, out.edges.end() - 1, x) - (out.edges.begin() + 1);
    out.bin.push_back(static_cast<std::uint16_t>(at));
  }
  out.usable = true;
  return out;
}

struct Cell {
  double n = 0.0, sum = 0.0;
};
// Sums over the samples of each block in each bin: [block * bins + bin].
std::vector<Cell> cells(const Binned& b, const std::vector<double>& r, std::span<const SampleBlock> blocks) {
  const std::size_t bins = b.edges.size() - 1;
  std::vector<Cell> out(blocks.size() * bins);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    for (std::size_t i = blocks[k].first; i < blocks[k].first + blocks[k].count; ++i) {
      Cell& c = out[k * bins + b.bin[i]];
      c.n += 1.0;
      c.sum += r[i];
    }
  }
  return out;
}

// Share of the power that the means of the other folds predict. Σ (r - m)² = Σ r² - 2 m Σ r + n m².
double held_out_share(const std::vector<Cell>& all, std::size_t bins, const std::vector<int>& fold, double power) {
  const int folds = fold.empty() ? 0 : *std::max_element(fold.begin(), fold.end()) + 1;
  if (folds < 2 || !(power > 0.0)) return 0.0;
  std::vector<Cell> total(bins), own(bins * static_cast<std::size_t>(folds));
  for (std::size_t k = 0; k < fold.size(); ++k) {
    for (std::size_t b = 0; b < bins; ++b) {
      const Cell& c = all[k * bins + b];
      Cell& o = own[static_cast<std::size_t>(fold[k]) * bins + b];
      total[b].n += c.n;
      total[b].sum += c.sum;
      o.n += c.n;
      o.sum += c.sum;
    }
  }
  double gain = 0.0;
  for (std::size_t i = 0; i < own.size(); ++i) {
    const Cell &o = own[i], &t = total[i % bins];
    const double n = t.n - o.n;
    if (o.n == 0.0 || n <= 0.0) continue;
    const double mean = (t.sum - o.sum) / n;
    gain += 2.0 * mean * o.sum - o.n * mean * mean;
  }
  return gain / power;
}

void add_bins(Dependence& d, const Binned& b, const std::vector<double>& input, const std::vector<Cell>& all, std::size_t blocks,
              const DependenceOptions& o) {
  const std::size_t bins = b.edges.size() - 1;
  std::vector<Cell> sum(bins);
  std::vector<double> centre(bins, 0.0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    sum[i % bins].n += all[i].n;
    sum[i % bins].sum += all[i].sum;
  }
  for (std::size_t i = 0; i < input.size(); ++i) centre[b.bin[i]] += input[i];
  std::vector<std::vector<double>> means(bins);
  const RandomStream random(o.seed, kDependenceBootstrap + 131 * d.axis + d.input);
  std::uint64_t drawn = 0;
  std::vector<Cell> again(bins);
  for (int n = 0; n < o.resamples; ++n) {
    std::fill(again.begin(), again.end(), Cell{});
    for (std::size_t k = 0; k < blocks; ++k) {
      const auto pick = static_cast<std::size_t>(random.uniform(drawn++) * static_cast<double>(blocks));
      for (std::size_t c = 0; c < bins; ++c) {
        again[c].n += all[pick * bins + c].n;
        again[c].sum += all[pick * bins + c].sum;
      }
    }
    for (std::size_t c = 0; c < bins; ++c) {
      if (again[c].n > 0.0) means[c].push_back(again[c].sum / again[c].n);
    }
  }
  for (std::size_t c = 0; c < bins; ++c) {
    if (sum[c].n == 0.0) continue;
    d.bins.push_back({b.edges[c], b.edges[c + 1], centre[c] / sum[c].n, static_cast<std::size_t>(sum[c].n), sum[c].sum / sum[c].n,
                      quantile(means[c], 0.025), quantile(means[c], 0.975)});
  }
}

// Means over cells of the floor plan, with the scatter between blocks as their uncertainty.
PlaceMap place_map(const std::vector<double>& r, const std::vector<double>& x, const std::vector<double>& y,
                   std::span<const SampleBlock> blocks, std::size_t axis) {
  PlaceMap m;
  m.axis = axis;
  const auto [x0, x1] = std::minmax_element(x.begin(), x.end());
  const auto [y0, y1] = std::minmax_element(y.begin(), y.end());
  m.x_from_m = *x0;
  m.y_from_m = *y0;
  m.cell_m = std::max(*x1 - *x0, *y1 - *y0) / static_cast<double>(kMapCells);
  if (!(m.cell_m > 0.0)) return m;
  m.columns = static_cast<std::size_t>((*x1 - *x0) / m.cell_m) + 1;
  m.rows = static_cast<std::size_t>((*y1 - *y0) / m.cell_m) + 1;
  const std::size_t n = m.columns * m.rows;
  struct Sums {
    double blocks = 0.0, mean = 0.0, square = 0.0;
  };
  std::vector<Sums> sums(n);
  for (const SampleBlock& b : blocks) {
    std::vector<Cell> cell(n);
    for (std::size_t i = b.first; i < b.first + b.count; ++i) {
      Cell& c = cell[static_cast<std::size_t>((y[i] - m.y_from_m) / m.cell_m) * m.columns +
                     static_cast<std::size_t>((x[i] - m.x_from_m) / m.cell_m)];
      c.n += 1.0;
      c.sum += r[i];
    }
    for (std::size_t c = 0; c < n; ++c) {
      if (cell[c].n == 0.0) continue;
      const double mean = cell[c].sum / cell[c].n;
      sums[c].blocks += 1.0;
      sums[c].mean += mean;
      sums[c].square += mean * mean;
    }
  }
  for (const Sums& s : sums) {
    const bool known = s.blocks >= static_cast<double>(kLeastBlocksOfSpread);
    const double mean = known ? s.mean / s.blocks : std::numeric_limits<double>::quiet_NaN();
    m.mean.push_back(mean);
    m.u.push_back(known ? std::sqrt(std::max(0.0, s.square / s.blocks - mean * mean) / (s.blocks - 1.0)) : mean);
  }
  return m;
}

}  // namespace

DependenceResult dependence(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                            const DependenceOptions& o) {
  DependenceResult out;
  const std::vector<SampleBlock> blocks = blocks_of(samples, o.block_s);
  const std::vector<int> fold = folds_of(samples, blocks, o.folds);
  if (blocks.size() < 4) return out;
  std::array<double, kAxes> power{}, chance{};
  for (std::size_t a = 0; a < kAxes; ++a) power[a] = mean_square(residual[a]) * static_cast<double>(samples.size);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const Binned b = binned(inputs[i].value, o.bins);
    if (!b.usable) continue;
    const std::size_t bins = b.edges.size() - 1;
    for (std::size_t a = 0; a < kAxes; ++a) {
      Dependence d{.input = i, .axis = a, .bins = {}};
      d.share = held_out_share(cells(b, residual[a], blocks), bins, fold, power[a]);
      for (const Axes& e : expected.first(std::min<std::size_t>(expected.size(), 8))) {
        const double noise = mean_square(e[a]) * static_cast<double>(samples.size);
        chance[a] = std::max(chance[a], held_out_share(cells(b, e[a], blocks), bins, fold, noise));
      }
      out.ranking.push_back(std::move(d));
    }
  }
  std::stable_sort(out.ranking.begin(), out.ranking.end(), [](const Dependence& p, const Dependence& q) { return p.share > q.share; });
  std::array<std::size_t, kAxes> seen{};
  for (Dependence& d : out.ranking) {
    d.chance = chance[d.axis];
    if (seen[d.axis]++ >= o.with_bins) continue;
    const Binned b = binned(inputs[d.input].value, o.bins);
    add_bins(d, b, inputs[d.input].value, cells(b, residual[d.axis], blocks), blocks.size(), o);
  }
  const auto channel = [&](std::string_view id) -> const std::vector<double>* {
    for (const Channel& c : inputs) {
      if (c.id == id) return &c.value;
    }
    return nullptr;
  };
  const auto *x = channel("place_x"), *y = channel("place_y");
  if (x && y && !x->empty()) {
    for (const std::size_t axis : {std::size_t{2}, std::size_t{0}, std::size_t{1}}) {
      PlaceMap m = place_map(residual[axis], *x, *y, blocks, axis);
      if (m.columns > 3 && m.rows > 3) out.maps.push_back(std::move(m));
    }
  }
  return out;
}

}  // namespace rotorloop::diagnose
