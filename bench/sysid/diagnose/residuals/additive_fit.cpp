#include "bench/sysid/diagnose/residuals/additive_fit.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "host/base/statistics.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop::diagnose {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The four cubic B-splines that are not zero at x, on `intervals` equal intervals of [low, high]; of a product the straight line.
struct Spline {
  std::size_t input = 0;
  Index first = 0, count = 0;  // columns of the design
  double low = 0.0, width = 1.0;

  bool line() const { return count == 1; }
  Index bases() const { return std::min<Index>(count, 4); }  // that are not zero at one place
  double high() const { return low + width * static_cast<double>(line() ? 1 : count - 3); }
  // The first basis that is not zero there.
  Index at(double x, std::array<double, 4>& b) const {
    if (line()) {
      b[0] = std::clamp((x - low) / width, 0.0, 1.0);
      return 0;
    }
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
      const double low = quantile(inputs[i].value, 0.01), high = quantile(inputs[i].value, 0.99);
      if (!(high - low > 1e-9 * (std::fabs(high) + std::fabs(low)))) continue;
      const std::size_t pieces = inputs[i].product ? 1 : intervals;
      splines.push_back(
          {i, columns, inputs[i].product ? 1 : static_cast<Index>(intervals) + 3, low, (high - low) / static_cast<double>(pieces)});
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
        for (Index j = 0; j < s.bases(); ++j) {
          column.push_back(s.first + k + j);
          value.push_back(basis[static_cast<std::size_t>(j)]);
        }
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
      v[j] = 1.0;
      v[j + 1] = -2.0;
      v[j + 2] = 1.0;
      out += v * v.transpose();
    }
    for (Index j = s.first; j < s.first + s.count; ++j) out(j, j) += 0.01;
  }
  return out;
}

double gain(const FoldSums& s, std::size_t f, const VectorXd& beta, Index y) {
  return 2.0 * beta.dot(s.xy[f].col(y)) - beta.dot(s.xx[f] * beta);
}

// The penalised regression of all residuals on the splines, from the sums of the folds.
class Regression {
 public:
  Regression(const Design& design, const FoldSums& folds, Index residuals)
      : design_(design),
        folds_(folds),
        xx_(MatrixXd::Zero(design.columns, design.columns)),
        xy_(MatrixXd::Zero(design.columns, residuals)),
        yy_(VectorXd::Zero(residuals)),
        shape_(penalty_of(design)) {
    for (std::size_t f = 0; f < folds.xx.size(); ++f) {
      xx_ += folds.xx[f];
      xy_ += folds.xy[f];
      yy_ += folds.yy[f];
    }
    information_ = xx_.diagonal().tail(design.columns - 1).sum() / static_cast<double>(std::max<Index>(1, design.columns - 1));
  }
  // The penalty under which the folds left out are predicted best, for each residual.
  void choose_penalties(std::span<const double> penalties, std::vector<AdditiveFit>& out) const;
  // The curve of each input, the one that explains most first, with jackknife uncertainty over the folds.
  std::vector<PartialCurve> curves(const AdditiveFit& fit, Index y) const;
  // Cross-validated share that is lost without an input.
  double share_of_input_alone(const AdditiveFit& fit, std::size_t input, Index y) const;

 private:
  MatrixXd solved(std::size_t left_out, double penalty, const VectorXd* keep, Index only = -1) const;
  PartialCurve curve(const Spline& spline, const VectorXd& whole, const std::vector<VectorXd>& parts, Index y) const;

  const Design& design_;
  const FoldSums& folds_;
  MatrixXd xx_, xy_;
  VectorXd yy_;
  MatrixXd shape_;
  double information_ = 0.0;  // mean of the diagonal: the scale of the penalty
};

// Coefficients from all folds but one, for one penalty, all residuals at once or `only` one; `keep`: 0 removes a column.
MatrixXd Regression::solved(std::size_t left_out, double penalty, const VectorXd* keep, Index only) const {
  MatrixXd m = xx_ + penalty * information_ * shape_;
  MatrixXd rhs = only < 0 ? xy_ : MatrixXd(xy_.col(only));
  if (left_out < folds_.xx.size()) {
    m -= folds_.xx[left_out];
    rhs -= only < 0 ? folds_.xy[left_out] : MatrixXd(folds_.xy[left_out].col(only));
  }
  if (keep) {
    m = keep->asDiagonal() * m * keep->asDiagonal();
    m.diagonal() += (VectorXd::Ones(design_.columns) - *keep) * information_;
    rhs = keep->asDiagonal() * rhs;
  }
  m.diagonal().array() += 1e-9 * information_;
  return LltFactor(m).solve(rhs);
}

void Regression::choose_penalties(std::span<const double> penalties, std::vector<AdditiveFit>& out) const {
  std::vector<double> best(out.size(), -1e300);
  for (const double penalty : penalties) {
    VectorXd total = VectorXd::Zero(yy_.size());
    for (std::size_t f = 0; f < folds_.xx.size(); ++f) {
      const MatrixXd beta = solved(f, penalty, nullptr);
      for (Index y = 0; y < total.size(); ++y) total[y] += gain(folds_, f, beta.col(y), y);
    }
    for (std::size_t y = 0; y < out.size(); ++y) {
      const auto i = static_cast<Index>(y);
      const double share = yy_[i] > 0.0 ? total[i] / yy_[i] : 0.0;
      if (share > best[y]) {
        best[y] = share;
        out[y].share = share;
        out[y].penalty = penalty;
      }
    }
  }
}

std::vector<PartialCurve> Regression::curves(const AdditiveFit& fit, Index y) const {
  const VectorXd whole = solved(folds_.xx.size(), fit.penalty, nullptr, y).col(0);
  std::vector<VectorXd> parts;
  for (std::size_t f = 0; f < folds_.xx.size(); ++f) parts.push_back(solved(f, fit.penalty, nullptr, y).col(0));
  std::vector<PartialCurve> out;
  for (const Spline& spline : design_.splines) out.push_back(curve(spline, whole, parts, y));
  std::stable_sort(out.begin(), out.end(), [](const PartialCurve& a, const PartialCurve& b) { return a.share > b.share; });
  return out;
}

PartialCurve Regression::curve(const Spline& spline, const VectorXd& whole, const std::vector<VectorXd>& parts, Index y) const {
  constexpr int kPoints = 25;
  PartialCurve c{.input = spline.input, .at = {}, .value = {}, .u = {}};
  const auto rows = Eigen::seqN(spline.first, spline.count);
  c.share = whole(rows).dot(xx_(rows, rows) * whole(rows)) / yy_[y];
  for (int n = 0; n < kPoints; ++n) {
    const double x = spline.low + (spline.high() - spline.low) * n / (kPoints - 1);
    std::array<double, 4> basis;
    const Index k = spline.at(x, basis);
    const auto value = [&](const VectorXd& beta) {
      double v = -design_.column_mean(rows).dot(beta(rows));
      for (Index j = 0; j < spline.bases(); ++j) v += basis[static_cast<std::size_t>(j)] * beta[spline.first + k + j];
      return v;
    };
    const double here = value(whole);
    double squares = 0.0;
    for (const VectorXd& p : parts) squares += (value(p) - here) * (value(p) - here);
    const auto f = static_cast<double>(parts.size());
    c.at.push_back(x);
    c.value.push_back(here);
    c.u.push_back(std::sqrt((f - 1.0) / f * squares));
  }
  return c;
}

double Regression::share_of_input_alone(const AdditiveFit& fit, std::size_t input, Index y) const {
  VectorXd keep = VectorXd::Ones(design_.columns);
  for (const Spline& spline : design_.splines) {
    if (spline.input == input) keep.segment(spline.first, spline.count).setZero();
  }
  double total = 0.0;
  for (std::size_t f = 0; f < folds_.xx.size(); ++f) total += gain(folds_, f, solved(f, fit.penalty, &keep, y).col(0), y);
  return fit.share - total / yy_[y];
}

}  // namespace

std::vector<AdditiveFit> additive_fit(const Samples& samples, std::span<const std::vector<double>* const> ys,
                                      std::span<const Channel> inputs, std::size_t with_curves, const AdditiveOptions& o) {
  std::vector<AdditiveFit> out(ys.size());
  const std::vector<SampleBlock> blocks = blocks_of(samples, o.block_s);
  const std::vector<int> fold = folds_of(samples, blocks, o.folds, o.left_out);
  const int folds = fold.empty() ? 0 : *std::max_element(fold.begin(), fold.end()) + 1;
  if (folds < 2) return out;
  Design design(inputs, o.intervals);
  const FoldSums s = sums(design, inputs, ys, samples, blocks, fold, folds);
  const Regression regression(design, s, static_cast<Index>(ys.size()));
  regression.choose_penalties(o.penalties, out);
  for (std::size_t y = 0; y < std::min(with_curves, ys.size()); ++y) {
    AdditiveFit& fit = out[y];
    const auto i = static_cast<Index>(y);
    if (!(fit.share > 0.0)) continue;
    fit.curves = regression.curves(fit, i);
    // What is lost without an input: only for the few that carry most.
    for (std::size_t n = 0; n < std::min<std::size_t>(4, fit.curves.size()); ++n)
      fit.curves[n].alone = regression.share_of_input_alone(fit, fit.curves[n].input, i);
  }
  return out;
}

}  // namespace rotorloop::diagnose
