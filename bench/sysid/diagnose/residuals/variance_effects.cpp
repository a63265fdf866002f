#include "bench/sysid/diagnose/residuals/variance_effects.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::diagnose {
namespace {

VarianceEffect named(const VarianceKind& k) {
  VarianceEffect e;
  e.id = k.id;
  e.what = k.what;
  e.parameter = k.parameter;
  e.unit = k.unit;
  return e;
}

// Block of each row of the kind's residuals; rows come in order of time within a flight.
std::vector<std::size_t> block_of_samples(const Samples& samples, const std::vector<SampleBlock>& blocks) {
  std::vector<std::size_t> out(samples.size);
  for (std::size_t b = 0; b < blocks.size(); ++b)
    std::fill_n(out.begin() + static_cast<std::ptrdiff_t>(blocks[b].first), blocks[b].count, b);
  return out;
}

struct RowView {
  std::size_t count = 0;
  const std::vector<std::size_t>* sample = nullptr;  // nullptr: row i is sample i
};
RowView view(const WhitenedResiduals& w, VarianceKind::Rows rows) {
  switch (rows) {
    case VarianceKind::Rows::poses:
      return {w.poses.size(), &w.pose_sample};
    case VarianceKind::Rows::accels:
      return {w.accels.size(), &w.accel_sample};
    case VarianceKind::Rows::steps:
      break;
  }
  return {w.steps.size(), nullptr};
}

// (g·r) of every column: 1 x columns.
Eigen::RowVectorXf along(const WhitenedResiduals& w, VarianceKind::Rows rows, std::size_t i, const Eigen::VectorXf& g) {
  switch (rows) {
    case VarianceKind::Rows::poses:
      return g.transpose() * w.poses[i];
    case VarianceKind::Rows::accels:
      return g.transpose() * w.accels[i];
    case VarianceKind::Rows::steps:
      break;
  }
  return g.transpose() * w.steps[i];
}

BlockScores block_scores(const ResidualSeries& r, const VarianceKind& kind, const std::vector<std::size_t>& block, std::size_t blocks,
                         const std::vector<double>& t) {
  const RowView rows = view(r.whitened, kind.rows);
  const Eigen::Index columns = r.whitened.steps.empty() ? 0 : r.whitened.steps.front().cols();
  BlockScores out{Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(blocks), columns)};
  std::size_t directions = 0;
  for (const auto& d : kind.directions) directions = std::max(directions, d.size());
  std::vector<Eigen::RowVectorXd> memory(directions, Eigen::RowVectorXd::Zero(columns));
  std::size_t last_block = blocks;
  double last_t = 0.0;
  for (std::size_t i = 0; i < rows.count; ++i) {
    const std::size_t s = rows.sample ? (*rows.sample)[i] : i, b = block[s];
    double keep = 0.0;
    if (kind.tau_s > 0.0 && b == last_block) keep = std::exp(-std::max(0.0, t[s] - last_t) / kind.tau_s);
    last_block = b;
    last_t = t[s];
    for (std::size_t d = 0; d < kind.directions[i].size(); ++d) {
      if (keep == 0.0) memory[d].setZero();
      const Eigen::VectorXf& g = kind.directions[i][d];
      if (g.isZero()) {
        memory[d] *= keep;
        continue;
      }
      const Eigen::RowVectorXd c = along(r.whitened, kind.rows, i, g).cast<double>();
      memory[d] *= keep;
      out.value.row(static_cast<Eigen::Index>(b)).array() += 0.5 * c.array().square() + c.array() * memory[d].array();
      memory[d] += c;
    }
  }
  return out;
}

// Noise figures that the fit has: process per axis, poses per number.
std::vector<BlockScores> nuisances(const ResidualSeries& r, const std::vector<std::size_t>& block, std::size_t blocks) {
  const WhitenedResiduals& w = r.whitened;
  const Eigen::Index columns = w.steps.empty() ? 0 : w.steps.front().cols(), n = static_cast<Eigen::Index>(blocks);
  std::vector<BlockScores> out(w.poses.empty() ? 6 : 12, BlockScores{Eigen::MatrixXd::Zero(n, columns)});
  for (std::size_t s = 0; s < w.steps.size(); ++s) {
    const auto b = static_cast<Eigen::Index>(block[s]);
    for (Eigen::Index a = 0; a < 6; ++a) {
      const Eigen::Index row = a < 3 ? a : a + 3;  // p, v and φ, Ω of one axis share a figure
      out[static_cast<std::size_t>(a)].value.row(b).array() +=
          0.5 * (w.steps[s].row(row).cast<double>().array().square() + w.steps[s].row(row + 3).cast<double>().array().square());
    }
  }
  for (std::size_t i = 0; i < w.poses.size(); ++i) {
    const auto b = static_cast<Eigen::Index>(block[w.pose_sample[i]]);
    for (Eigen::Index a = 0; a < 6; ++a)
      out[static_cast<std::size_t>(6 + a)].value.row(b).array() += 0.5 * w.poses[i].row(a).cast<double>().array().square();
  }
  if (!w.accels.empty()) {
    out.push_back({Eigen::MatrixXd::Zero(n, columns)});
    for (std::size_t i = 0; i < w.accels.size(); ++i)
      out.back().value.row(static_cast<Eigen::Index>(block[w.accel_sample[i]])).array() +=
          0.5 * w.accels[i].cast<double>().colwise().squaredNorm().array();
  }
  return out;
}

// Less the mean over simulated residuals: zero under the model, in every block.
void centre(BlockScores& s) {
  const Eigen::Index simulated = s.value.cols() - 1;
  const Eigen::VectorXd mean = s.value.rightCols(simulated).rowwise().mean();
  s.value.colwise() -= mean;
}

// Covariance of two scores over the simulated residuals of blocks [from, to).
double covariance(const BlockScores& a, const BlockScores& b, Eigen::Index from, Eigen::Index to) {
  const Eigen::Index n = a.value.cols() - 1;
  return a.value.block(from, 1, to - from, n).cwiseProduct(b.value.block(from, 1, to - from, n)).sum() / static_cast<double>(n - 1);
}

// Takes off `s` what the scores in `of` predict, in blocks [from, to).
void reduce(BlockScores& s, const std::vector<BlockScores>& of, Eigen::Index from, Eigen::Index to) {
  const auto n = static_cast<Eigen::Index>(of.size());
  Eigen::MatrixXd v(n, n);
  Eigen::VectorXd c(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j)
      v(i, j) = v(j, i) = covariance(of[static_cast<std::size_t>(i)], of[static_cast<std::size_t>(j)], from, to);
    c[i] = covariance(s, of[static_cast<std::size_t>(i)], from, to);
  }
  v.diagonal() *= 1.0 + 1e-6;
  for (Eigen::Index i = 0; i < n; ++i) v(i, i) = std::max(v(i, i), 1e-12);
  const Eigen::VectorXd share = LdltFactor(v).solve(c);
  for (Eigen::Index i = 0; i < n; ++i)
    s.value.middleRows(from, to - from) -= share[i] * of[static_cast<std::size_t>(i)].value.middleRows(from, to - from);
}

}  // namespace

ScoreTest score_test(const BlockScores& s, std::span<const std::size_t> flight) {
  ScoreTest out;
  const Eigen::Index blocks = s.value.rows(), simulated = s.value.cols() - 1;
  if (blocks < 6 || simulated < 8) return out;
  const Eigen::VectorXd information = s.value.rightCols(simulated).rowwise().squaredNorm() / static_cast<double>(simulated - 1);
  const double total = s.value.col(0).sum(), all = information.sum();
  if (!(all > 0.0)) return out;
  out.gamma = total / all;
  out.gain = 0.5 * total * out.gamma;
  // The effect's own part is taken off each block, else its size would be counted as scatter; none is taken off for a negative one.
  const Eigen::VectorXd rest = s.value.col(0) - information * std::max(0.0, out.gamma);
  double v = rest.squaredNorm(), neighbours = 0.0;
  for (Eigen::Index b = 0; b + 1 < blocks; ++b) {
    if (flight[static_cast<std::size_t>(b)] == flight[static_cast<std::size_t>(b + 1)]) neighbours += rest[b] * rest[b + 1];
  }
  const auto n = static_cast<double>(blocks);
  v = std::max(v + neighbours, 0.5 * v) * n / (n - 1.0);
  v = std::max(v, all);  // never better known than the model's own noise allows
  out.u_gamma = std::sqrt(v) / all;
  out.t = total / std::sqrt(v);
  const double two_sided = f_tail(out.t * out.t, 1.0, n - 1.0);
  out.p = out.t > 0.0 ? 0.5 * two_sided : 1.0 - 0.5 * two_sided;
  return out;
}

namespace {

// Takes off the scores of each flight what the nuisances predict of them there.
void reduce_by_flight(BlockScores& s, const std::vector<BlockScores>& of, std::span<const std::size_t> flight) {
  const auto rows = static_cast<Eigen::Index>(flight.size());
  for (Eigen::Index from = 0; from < rows;) {
    Eigen::Index to = from;
    while (to < rows && flight[static_cast<std::size_t>(to)] == flight[static_cast<std::size_t>(from)]) ++to;
    reduce(s, of, from, to);
    from = to;
  }
}

// `marginal`: the scores of all kinds before the effects found took their share.
VarianceEffect entry(std::span<const VarianceKind> kinds, std::size_t k, const std::vector<BlockScores>& marginal, const ScoreTest& test,
                     double p_holm, const Criteria& criteria) {
  VarianceEffect e = named(kinds[k]);
  e.t = test.t;
  e.p = test.p;
  e.p_holm = p_holm;
  e.size = std::sqrt(std::max(0.0, test.gamma));
  e.u = e.size > 0.0 ? test.u_gamma / (2.0 * e.size) : std::sqrt(test.u_gamma);
  const Eigen::Index rows = marginal[k].value.rows();
  for (std::size_t j = 0; j < kinds.size(); ++j) {
    if (j == k || !kinds[j].untested.empty()) continue;
    const double both = covariance(marginal[k], marginal[j], 0, rows);
    const double c = both / std::sqrt(covariance(marginal[k], marginal[k], 0, rows) * covariance(marginal[j], marginal[j], 0, rows));
    if (c > 1.0 - criteria.negligible) e.aliases.emplace_back(kinds[j].id.empty() ? kinds[j].what : kinds[j].id, c);
  }
  return e;
}

// Of those that are there, the one that raises the likelihood most goes first; t alone cannot rank them, for the scatter of an
// effect that comes in gusts bounds it. A significant one stands before all that are not.
std::vector<std::size_t> ranked(const std::vector<ScoreTest>& test, const std::vector<double>& adjusted, double level) {
  std::vector<std::size_t> order(test.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const bool pa = adjusted[a] < level, pb = adjusted[b] < level;
    return pa != pb ? pa : pa ? test[a].gain > test[b].gain : test[a].t > test[b].t;
  });
  return order;
}

}  // namespace

VarianceResult variance_effects(const ResidualSeries& r, std::span<const VarianceKind> kinds, const VarianceOptions& o) {
  VarianceResult out;
  const std::vector<SampleBlock> blocks = blocks_of(r.samples, o.block_s);
  const std::vector<std::size_t> block = block_of_samples(r.samples, blocks);
  const std::vector<double> t = times_s(r.samples);
  out.blocks = blocks.size();
  std::vector<std::size_t> flight;
  for (const SampleBlock& b : blocks) flight.push_back(b.flight);
  std::vector<BlockScores> of = nuisances(r, block, blocks.size());
  for (BlockScores& s : of) centre(s);
  std::vector<BlockScores> score(kinds.size());
  std::vector<std::size_t> open;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (!kinds[k].untested.empty()) continue;
    score[k] = block_scores(r, kinds[k], block, blocks.size(), t);
    centre(score[k]);
    reduce_by_flight(score[k], of, flight);
    open.push_back(k);
  }
  const std::vector<BlockScores> marginal = score;
  for (int round = 0;; ++round) {
    std::vector<ScoreTest> test;
    std::vector<double> p;
    for (const std::size_t k : open) {
      test.push_back(score_test(score[k], flight));
      p.push_back(test.back().p);
    }
    const std::vector<double> adjusted = holm(p);
    const std::vector<std::size_t> order = ranked(test, adjusted, o.criteria.chance);
    if (order.empty() || round >= o.most || adjusted[order.front()] >= o.criteria.chance) {
      for (const std::size_t i : order) out.effects.push_back(entry(kinds, open[i], marginal, test[i], adjusted[i], o.criteria));
      break;
    }
    const std::size_t best = open[order.front()];
    out.effects.push_back(entry(kinds, best, marginal, test[order.front()], adjusted[order.front()], o.criteria));
    out.effects.back().found = true;
    open.erase(open.begin() + static_cast<std::ptrdiff_t>(order.front()));
    const std::vector<BlockScores> of_best{score[best]};
    for (const std::size_t k : open) reduce(score[k], of_best, 0, static_cast<Eigen::Index>(blocks.size()));
  }
  for (const VarianceKind& k : kinds) {
    if (k.untested.empty()) continue;
    out.effects.push_back(named(k));
    out.effects.back().untested = k.untested;
  }
  return out;
}

}  // namespace rotorloop::diagnose
