#include "bench/diagnose/residuals/additive_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "bench/log/check/signal.hpp"

namespace rotorloop::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The four cubic B-splines that are not zero at x, on `intervals` equal intervals of [low, high].
struct Spline {
  std::size_t input = 0;
  Index first = 0, count = 0;  // columns of the design
  double low = 0.0, width = 1.0;

  Index at(double x, std::array<double, 4>& b) const {
    const double last = static_cast<double>(count - 3);
    const double u = std::clamp((x - low) / width, 0.0, last - 1e-9), k = std::floor(u), t = u - k;
    const double s = 1.0 - t;
    b = {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0, (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0};
    return static_cast<Index>(k);
  }
};

struct Design {
  std::vector<Spline> splines;
  Index columns = 1;  // column 0 is the constant
  VectorXd column_mean;

  Design(std::span<const Channel> inputs, std::size_t intervals) {
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const double low = log::quantile(inputs[i].value, 0.01), high = log::quantile(inputs[i].value, 0.99);
      if (!(high - low > 1e-9 * (std::fabs(high) + std::fabs(low)))) continue;
      splines.push_back({i, columns, static_cast<Index>(intervals) + 3, low, (high - low) / static_cast<double>(intervals)});
      columns += splines.back().count;
    }
    column_mean = VectorXd::Zero(columns);
  }
};

// [X y…]ᵀ[X y…] of the samples of each fold. Bases are centred over all samples, so that curves have mean zero and the constant is
// the mean.
struct FoldSums {
  std::vector<MatrixXd> xx, xy;
  std::vector<VectorXd> yy;
};
FoldSums sums(Design& design, std::span<const Channel> inputs, std::span<const std::vector<double>* const> ys, const Samples& samples,
              std::span<const SampleBlock> blocks, const std::vector<int>& fold, int folds) {
  FoldSums out;
  const Index p = design.columns, q = static_cast<Index>(ys.size());
  for (int f = 0; f < folds; ++f) {
    out.xx.push_back(MatrixXd::Zero(p, p));
    out.xy.push_back(MatrixXd::Zero(p, q));
    out.yy.push_back(VectorXd::Zero(q));
  }
  std::vector<Index> column;
  std::vector<double> value;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const auto f = static_cast<std::size_t>(fold[b]);
    for (std::size_t i = blocks[b].first; i < blocks[b].first + blocks[b].count; ++i) {
      column.assign(1, 0);
      value.assign(1, 1.0);
      std::array<double, 4> basis;
      for (const Spline& s : design.splines) {
        const Index k = s.at(inputs[s.input].value[i], basis);
        for (Index j = 0; j < 4; ++j) column.push_back(s.first + k + j), value.push_back(basis[static_cast<std::size_t>(j)]);
      }
      MatrixXd& xx = out.xx[f];
      for (std::size_t a = 0; a < column.size(); ++a) {
        for (std::size_t c = 0; c <= a; ++c) xx(column[a], column[c]) += value[a] * value[c];
        for (Index y = 0; y < q; ++y) out.xy[f](column[a], y) += value[a] * (*ys[static_cast<std::size_t>(y)])[i];
      }
      for (Index y = 0; y < q; ++y) {
        const double v = (*ys[static_cast<std::size_t>(y)])[i];
        out.yy[f][y] += v * v;
      }
    }
  }
  // Centring by the means over everything: X <- X - 1 meanᵀ, by the sums alone.
  for (const MatrixXd& xx : out.xx) design.column_mean += xx.col(0);
  design.column_mean /= static_cast<double>(samples.size);
  design.column_mean[0] = 0.0;
  for (std::size_t f = 0; f < out.xx.size(); ++f) {
    MatrixXd full = out.xx[f].selfadjointView<Eigen::Lower>();
    const VectorXd ones = full.col(0), y_sum = out.xy[f].row(0);
    const double n = ones[0];
    const VectorXd& m = design.column_mean;
    full -= ones * m.transpose() + m * ones.transpose() - n * m * m.transpose();
    out.xx[f] = full;
    out.xy[f] -= m * y_sum.transpose();
  }
  return out;
}

// Second differences of neighbouring coefficients, and a hundredth of it on the coefficients themselves: under heavy penalty a
// function becomes a straight line, and in the end nothing.
MatrixXd penalty_of(const Design& d) {
  MatrixXd out = MatrixXd::Zero(d.columns, d.columns);
  for (const Spline& s : d.splines) {
    for (Index j = s.first; j + 2 < s.first + s.count; ++j) {
      VectorXd v = VectorXd::Zero(d.columns);
      v[j] = 1.0, v[j + 1] = -2.0, v[j + 2] = 1.0;
      out += v * v.transpose();
    }
    for (Index j = s.first; j < s.first + s.count; ++j) out(j, j) += 0.01;
  }
  return out;
}

double gain(const FoldSums& s, std::size_t f, const VectorXd& beta, Index y) {
  return 2.0 * beta.dot(s.xy[f].col(y)) - beta.dot(s.xx[f] * beta);
}

}  // namespace

std::vector<AdditiveFit> additive_fit(const Samples& samples, std::span<const std::vector<double>* const> ys,
                                      std::span<const Channel> inputs, std::size_t with_curves, const AdditiveOptions& o) {
  std::vector<AdditiveFit> out(ys.size());
  const std::vector<SampleBlock> blocks = blocks_of(samples, o.block_s);
  const std::vector<int> fold = folds_of(samples, blocks, o.folds);
  const int folds = fold.empty() ? 0 : *std::max_element(fold.begin(), fold.end()) + 1;
  if (folds < 2) return out;
  Design design(inputs, o.intervals);
  const FoldSums s = sums(design, inputs, ys, samples, blocks, fold, folds);
  MatrixXd xx = MatrixXd::Zero(design.columns, design.columns), xy = MatrixXd::Zero(design.columns, static_cast<Index>(ys.size()));
  VectorXd yy = VectorXd::Zero(static_cast<Index>(ys.size()));
  for (std::size_t f = 0; f < s.xx.size(); ++f) xx += s.xx[f], xy += s.xy[f], yy += s.yy[f];
  const MatrixXd shape = penalty_of(design);
  const double information = xx.diagonal().tail(design.columns - 1).sum() / static_cast<double>(std::max<Index>(1, design.columns - 1));

  // Coefficients from all folds but one, for one penalty, all residuals at once or `only` one; `keep`: 0 removes a column.
  const auto solved = [&](std::size_t left_out, double penalty, const VectorXd* keep, Index only = -1) {
    MatrixXd m = xx + penalty * information * shape;
    MatrixXd rhs = only < 0 ? xy : MatrixXd(xy.col(only));
    if (left_out < s.xx.size()) m -= s.xx[left_out], rhs -= only < 0 ? s.xy[left_out] : MatrixXd(s.xy[left_out].col(only));
    if (keep) {
      m = keep->asDiagonal() * m * keep->asDiagonal();
      m.diagonal() += (VectorXd::Ones(design.columns) - *keep) * information;
      rhs = keep->asDiagonal() * rhs;
    }
    m.diagonal().array() += 1e-9 * information;
    return MatrixXd(m.llt().solve(rhs));
  };
  std::vector<double> best(ys.size(), -1e300);
  for (const double penalty : o.penalties) {
    VectorXd total = VectorXd::Zero(static_cast<Index>(ys.size()));
    for (std::size_t f = 0; f < s.xx.size(); ++f) {
      const MatrixXd beta = solved(f, penalty, nullptr);
      for (Index y = 0; y < total.size(); ++y) total[y] += gain(s, f, beta.col(y), y);
    }
    for (std::size_t y = 0; y < ys.size(); ++y) {
      const auto i = static_cast<Index>(y);
      const double share = yy[i] > 0.0 ? total[i] / yy[i] : 0.0;
      if (share > best[y]) best[y] = share, out[y].share = share, out[y].penalty = penalty;
    }
  }
  for (std::size_t y = 0; y < std::min(with_curves, ys.size()); ++y) {
    AdditiveFit& fit = out[y];
    const auto i = static_cast<Index>(y);
    if (!(fit.share > 0.0)) continue;
    const VectorXd whole = solved(s.xx.size(), fit.penalty, nullptr, i).col(0);
    std::vector<VectorXd> parts;
    for (std::size_t f = 0; f < s.xx.size(); ++f) parts.push_back(solved(f, fit.penalty, nullptr, i).col(0));
    for (const Spline& sp : design.splines) {
      PartialCurve c{.input = sp.input, .at = {}, .value = {}, .u = {}};
      const auto rows = Eigen::seqN(sp.first, sp.count);
      c.share = whole(rows).dot(xx(rows, rows) * whole(rows)) / yy[i];
      constexpr int kPoints = 25;
      for (int n = 0; n < kPoints; ++n) {
        const double x = sp.low + sp.width * static_cast<double>(sp.count - 3) * n / (kPoints - 1);
        std::array<double, 4> basis;
        const Index k = sp.at(x, basis);
        const auto value = [&](const VectorXd& beta) {
          double v = -design.column_mean(rows).dot(beta(rows));
          for (Index j = 0; j < 4; ++j) v += basis[static_cast<std::size_t>(j)] * beta[sp.first + k + j];
          return v;
        };
        const double here = value(whole);
        double squares = 0.0;
        for (const VectorXd& p : parts) squares += (value(p) - here) * (value(p) - here);
        const auto f = static_cast<double>(parts.size());
        c.at.push_back(x), c.value.push_back(here), c.u.push_back(std::sqrt((f - 1.0) / f * squares));
      }
      fit.curves.push_back(std::move(c));
    }
    std::stable_sort(fit.curves.begin(), fit.curves.end(), [](const PartialCurve& a, const PartialCurve& b) { return a.share > b.share; });
    // What is lost without an input: only for the few that carry most.
    for (std::size_t n = 0; n < std::min<std::size_t>(4, fit.curves.size()); ++n) {
      VectorXd keep = VectorXd::Ones(design.columns);
      for (const Spline& sp : design.splines) {
        if (sp.input == fit.curves[n].input) keep.segment(sp.first, sp.count).setZero();
      }
      double total = 0.0;
      for (std::size_t f = 0; f < s.xx.size(); ++f) total += gain(s, f, solved(f, fit.penalty, &keep, i).col(0), i);
      fit.curves[n].alone = fit.share - total / yy[i];
    }
  }
  return out;
}

}  // namespace rotorloop::diagnose
