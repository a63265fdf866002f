#include "bench/sysid/diagnose/score_table.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::diagnose {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Index = ScoreTable::Index;

constexpr double kOpen = 1e-6;         // of a column's own information: what is less is rounding, or the model's own
constexpr double kFewestBlocks = 4.0;  // degrees of freedom of the scatter, at least

// Scaled to unit diagonal, so that kilograms and radians may stand side by side; solved with the least ridge that rounding asks for.
class Scaled {
 public:
  explicit Scaled(const MatrixXd& s) : scale_(s.diagonal()) {
    for (Index i = 0; i < scale_.size(); ++i) scale_[i] = scale_[i] > 0.0 ? 1.0 / std::sqrt(scale_[i]) : 1.0;
    MatrixXd a = scale_.asDiagonal() * s * scale_.asDiagonal();
    a.diagonal().array() += 1e-13;
    factor_.emplace(a);
  }
  MatrixXd solve(const MatrixXd& rhs) const { return scale_.asDiagonal() * factor_->solve(MatrixXd(scale_.asDiagonal() * rhs)); }

 private:
  VectorXd scale_;
  std::optional<LdltFactor> factor_;
};

struct ReducedGroup {
  MatrixXd information;  // S̃
  VectorXd score;        // s̃
  MatrixXd a;            // S_γθ S_θθ⁻¹
  MatrixXd own;          // S_γγ
};

ReducedGroup reduce(const MatrixXd& s, const VectorXd& score, const ColumnSet& model, const ColumnSet& group) {
  ReducedGroup out;
  out.information = s(group, group);
  out.own = out.information;
  out.score = score(group);
  out.a = MatrixXd::Zero(static_cast<Index>(group.size()), static_cast<Index>(model.size()));
  if (model.empty()) return out;
  out.a = Scaled(s(model, model)).solve(s(model, group)).transpose();
  out.information -= out.a * s(model, group);
  out.information = (0.5 * (out.information + out.information.transpose())).eval();
  out.score -= out.a * score(model);
  return out;
}

// T with TᵀS̃T = 1 over those of the directions `along` that are open: scaled to the group's own information first.
MatrixXd whitening(const ReducedGroup& r, const MatrixXd& along) {
  VectorXd k = (along.transpose() * r.own * along).diagonal();
  for (Index i = 0; i < k.size(); ++i) k[i] = k[i] > 0.0 ? 1.0 / std::sqrt(k[i]) : 0.0;
  const MatrixXd information = along.transpose() * r.information * along;
  const SymmetricEigen eig = symmetric_eigen(k.asDiagonal() * information * k.asDiagonal());
  std::vector<Index> kept;
  for (Index i = 0; i < k.size(); ++i) {
    if (eig.values[i] > kOpen) kept.push_back(i);
  }
  MatrixXd t(k.size(), static_cast<Index>(kept.size()));
  for (std::size_t j = 0; j < kept.size(); ++j)
    t.col(static_cast<Index>(j)) = k.asDiagonal() * eig.vectors.col(kept[j]) / std::sqrt(eig.values[kept[j]]);
  return along * t;
}

// Where the columns `wanted` stand among those of a block; -1: the block does not know one.
std::vector<Index> places(const ScoreTable::Block& b, const ColumnSet& wanted) {
  std::vector<Index> out;
  for (const Index w : wanted) {
    const auto found = std::find(b.at.begin(), b.at.end(), w);
    out.push_back(found == b.at.end() ? -1 : found - b.at.begin());
  }
  return out;
}

// -A Δs_θ + Δs_γ where everything has taken its estimated `step`, and the information [-A I] ΔS [-A I]ᵀ of the group alone, in the
// whitened directions of `t`.
struct BlockPart {
  VectorXd score;
  MatrixXd information;
};
BlockPart part_of(const ScoreTable::Block& b, const ColumnSet& model, const ColumnSet& group, const MatrixXd& a, const MatrixXd& t,
                  const VectorXd& step) {
  const ColumnSet all = with(model, group);
  const auto at = places(b, all);
  MatrixXd left(a.rows(), static_cast<Index>(all.size()));
  left << -a, MatrixXd::Identity(a.rows(), a.rows());
  std::vector<Index> columns, from;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (at[i] < 0) continue;
    columns.push_back(static_cast<Index>(i));
    from.push_back(at[i]);
  }
  const MatrixXd mix = t.transpose() * left(Eigen::all, columns);
  const MatrixXd information = b.information(from, from);
  return {mix * (b.score(from) + information * step(columns)), mix * information * mix.transpose()};
}

// Adds what the blocks of a fold know of the columns.
void gather_fold(const ScoreTable& table, int fold, const ColumnSet& columns, MatrixXd& s, VectorXd& score) {
  for (std::size_t i = 0; i < table.blocks.size(); ++i) {
    if (table.fold[i] != fold) continue;
    const auto& b = table.blocks[i];
    const auto at = places(b, columns);
    for (std::size_t x = 0; x < at.size(); ++x) {
      if (at[x] < 0) continue;
      score[static_cast<Index>(x)] += b.score[at[x]];
      for (std::size_t y = 0; y < at.size(); ++y) {
        if (at[y] >= 0) s(static_cast<Index>(x), static_cast<Index>(y)) += b.information(at[x], at[y]);
      }
    }
  }
}

}  // namespace

ColumnSet with(ColumnSet a, const ColumnSet& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

MatrixXd directions(const std::vector<ColumnSet>& sums_held, const ColumnSet& group) {
  const auto d = static_cast<Index>(group.size());
  MatrixXd sums(d, 0);
  for (const ColumnSet& held : sums_held) {
    VectorXd within(d);
    for (Index i = 0; i < d; ++i) within[i] = std::find(held.begin(), held.end(), group[static_cast<std::size_t>(i)]) != held.end();
    if (within.sum() < static_cast<double>(held.size())) continue;
    sums.conservativeResize(d, sums.cols() + 1);
    sums.rightCols(1) = within;
  }
  if (sums.cols() == 0) return MatrixXd::Identity(d, d);
  return symmetric_eigen(sums * sums.transpose()).vectors.leftCols(d - sums.cols());  // of the eigenvalues 0, which come first
}

ColumnSet base_columns(const ScoreTable& table) {
  ColumnSet out;
  for (Index i = 0; i < table.base; ++i) out.push_back(i);
  return out;
}

GroupTest test_group(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group) {
  GroupTest out;
  const auto d = static_cast<Index>(group.size());
  out.estimate = VectorXd::Zero(d);
  out.covariance = MatrixXd::Zero(d, d);
  const ReducedGroup r = reduce(table.information, table.score, model, group);
  for (Index i = 0; i < d; ++i) {
    if (r.own(i, i) > 0.0) out.open = std::max(out.open, r.information(i, i) / r.own(i, i));
  }
  const MatrixXd t = whitening(r, directions(table.sums_held, group));
  out.degrees = static_cast<int>(t.cols());
  if (out.degrees == 0) return out;
  const VectorXd z = t.transpose() * r.score;  // standard normal under the model with white residuals
  out.estimate = -t * z;
  out.chi2 = z.squaredNorm();

  VectorXd step(static_cast<Index>(model.size()) + d);
  step.tail(d) = out.estimate;
  if (!model.empty())
    step.head(static_cast<Index>(model.size())) =
        -Scaled(table.information(model, model)).solve(table.score(model) + table.information(model, group) * out.estimate);

  // Scatter of the blocks with the effect taken out, neighbours included.
  MatrixXd v = MatrixXd::Zero(t.cols(), t.cols());
  VectorXd last;
  std::size_t last_flight = 0, count = 0;
  double sum = 0.0, squares = 0.0;
  for (const ScoreTable::Block& b : table.blocks) {
    const BlockPart part = part_of(b, model, group, r.a, t, step);
    const VectorXd& u = part.score;
    v += u * u.transpose();
    if (count > 0 && last_flight == b.flight) {
      const MatrixXd cross = last * u.transpose();
      v += 0.5 * (cross + cross.transpose());
    }
    last = u;
    last_flight = b.flight;
    ++count;
    const double information = part.information.trace();
    sum += information;
    squares += information * information;
  }
  if (count > 1) v *= static_cast<double>(count) / static_cast<double>(count - 1);
  out.blocks = squares > 0.0 ? sum * sum / squares : 0.0;
  // Correlation can make an estimate worse than the classical variance says, hardly better: a smaller scatter is chance.
  const SymmetricEigen eig = symmetric_eigen(v);
  const VectorXd spread = eig.values.cwiseMax(1.0);
  out.inflation = spread.mean();
  const VectorXd along = eig.vectors.transpose() * z;
  const double robust = (along.array().square() / spread.array()).sum();
  out.gain = 0.5 * robust;
  out.wald = robust / out.degrees;
  out.p = f_tail(out.wald, out.degrees, std::max(kFewestBlocks, out.blocks - out.degrees));
  out.covariance = t * eig.vectors * spread.asDiagonal() * eig.vectors.transpose() * t.transpose();
  return out;
}

double information_along(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group, const VectorXd& change) {
  return change.dot(reduce(table.information, table.score, model, group).information * change);
}

double cross_validated_gain(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group, double inflation) {
  const ColumnSet all = with(model, group);
  const auto n = static_cast<Index>(all.size()), m = static_cast<Index>(model.size());
  const int folds = table.fold.empty() ? 0 : *std::max_element(table.fold.begin(), table.fold.end()) + 1;
  const MatrixXd whole = table.information(all, all);
  const VectorXd whole_score = table.score(all);
  double sum = 0.0;
  for (int f = 0; f < folds; ++f) {
    MatrixXd s = MatrixXd::Zero(n, n);
    VectorXd score = VectorXd::Zero(n);
    gather_fold(table, f, all, s, score);
    const MatrixXd rest = whole - s;
    const VectorXd rest_score = whole_score - score;
    const auto cost = [&](const VectorXd& step) { return score.dot(step) + 0.5 * step.dot(s * step); };
    VectorXd without = VectorXd::Zero(n);
    without.head(m) = -Scaled(rest.topLeftCorner(m, m)).solve(rest_score.head(m));
    // The group's own estimate from the other folds, in the directions that they know.
    ColumnSet inner_model, inner_group;
    for (Index i = 0; i < n; ++i) (i < m ? inner_model : inner_group).push_back(i);
    const ReducedGroup r = reduce(rest, rest_score, inner_model, inner_group);
    const MatrixXd t = whitening(r, directions(table.sums_held, group));
    VectorXd step = VectorXd::Zero(n);
    step.tail(n - m) = -t * (t.transpose() * r.score);
    step.head(m) = -Scaled(rest.topLeftCorner(m, m)).solve(rest_score.head(m) + rest.topRightCorner(m, n - m) * step.tail(n - m));
    sum += cost(without) - cost(step);
  }
  return sum / inflation;
}

double optimism(const ScoreTable& table, const ColumnSet& columns) {
  const auto n = static_cast<Index>(columns.size());
  const int folds = table.fold.empty() ? 0 : *std::max_element(table.fold.begin(), table.fold.end()) + 1;
  double sum = 0.0;
  for (int f = 0; f < folds; ++f) {
    MatrixXd s = MatrixXd::Zero(n, n);
    VectorXd score = VectorXd::Zero(n);
    gather_fold(table, f, columns, s, score);
    const VectorXd step = -Scaled(table.information(columns, columns) - s).solve(table.score(columns) - score);
    sum += score.dot(step) + 0.5 * step.dot(s * step);
  }
  return sum;
}

Heterogeneity heterogeneity(const ScoreTable& table, const ColumnSet& model, const ColumnSet& group, const VectorXd& size) {
  const double chi2 = information_along(table, model, group, size);
  const GroupTest t = test_group(table, model, group);
  return {chi2 > 0.0 ? std::sqrt((t.inflation - 1.0) * t.degrees * t.blocks / chi2) : 0.0, t.inflation};
}

VectorXd canonical_correlations(const ScoreTable& table, const ColumnSet& model, const ColumnSet& a, const ColumnSet& b) {
  const ColumnSet both = with(a, b);
  const ReducedGroup r = reduce(table.information, table.score, model, both);
  const auto na = static_cast<Index>(a.size()), nb = static_cast<Index>(b.size());
  const auto part = [&](Index from, const ColumnSet& group) {
    const auto count = static_cast<Index>(group.size());
    ReducedGroup p;
    p.information = r.information.block(from, from, count, count);
    p.own = r.own.block(from, from, count, count);
    return whitening(p, directions(table.sums_held, group));
  };
  const MatrixXd ta = part(0, a), tb = part(na, b);
  if (ta.cols() == 0 || tb.cols() == 0) return VectorXd(0);
  const MatrixXd c = ta.transpose() * r.information.topRightCorner(na, nb) * tb;
  // Singular values of c: roots of the eigenvalues of the smaller of cᵀc and ccᵀ.
  const MatrixXd squared = c.cols() < c.rows() ? MatrixXd(c.transpose() * c) : MatrixXd(c * c.transpose());
  return symmetric_eigenvalues(squared).reverse().cwiseMax(0.0).cwiseSqrt().cwiseMin(1.0);
}

double confounding(const ScoreTable& table, const ColumnSet& model, const ColumnSet& a, const ColumnSet& b) {
  const VectorXd all = canonical_correlations(table, model, a, b);
  return all.size() > 0 ? all[0] : 0.0;
}

}  // namespace rotorloop::diagnose
