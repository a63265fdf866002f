#include "host/base/block_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "host/base/error.hpp"
#include "host/base/random.hpp"
#include "host/base/symmetric_matrix.hpp"

namespace rotorloop {
namespace {

constexpr int kResamples = 1000;
constexpr std::uint64_t kResamplingModule = 0x7374616e64;  // "stand"

std::vector<std::vector<Eigen::Index>> members(const std::vector<int>& block) {
  const std::set<int> ids(block.begin(), block.end());
  std::vector<std::vector<Eigen::Index>> out;
  for (const int id : ids) {
    out.emplace_back();
    for (std::size_t i = 0; i < block.size(); ++i)
      if (block[i] == id) out.back().push_back(static_cast<Eigen::Index>(i));
  }
  return out;
}

// Columns scaled to unit length: ω² and ω² J differ by nothing that matters, a constant and ω² by ten orders.
Eigen::VectorXd lengths(const Eigen::MatrixXd& X) {
  Eigen::VectorXd s = X.colwise().norm();
  for (auto& v : s) v = v > 0.0 ? v : 1.0;
  return s;
}

}  // namespace

double rms_of(const Eigen::VectorXd& e) { return e.size() == 0 ? 0.0 : std::sqrt(e.squaredNorm() / static_cast<double>(e.size())); }

BlockFit fit_in_blocks(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<int>& block) {
  const Eigen::Index n = X.rows(), d = X.cols();
  if (n < d + 1)
    throw Error(
        {"fit", fmt::format("{} points for {} unknowns", n, d), "nothing is left after the checks", "look at the faults that were found"},
        ExitCode::data_quality);
  const Eigen::VectorXd scale = lengths(X);
  const Eigen::MatrixXd A = X * scale.cwiseInverse().asDiagonal();
  const LdltFactor normal(A.transpose() * A);
  BlockFit f;
  const Eigen::VectorXd c = normal.solve(Eigen::VectorXd(A.transpose() * y));
  f.residual = y - A * c;
  f.rms = rms_of(f.residual);
  f.r2 = 1.0 - f.residual.squaredNorm() / (y.array() - y.mean()).square().sum();
  const Eigen::MatrixXd inverse = normal.inverse();
  const double s2 = f.residual.squaredNorm() / static_cast<double>(n - d);
  const auto blocks = members(block);
  f.blocks = blocks.size();
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(d, d);
  for (const auto& b : blocks) {
    Eigen::VectorXd s = Eigen::VectorXd::Zero(d);
    for (const auto i : b) s += A.row(i).transpose() * f.residual(i);
    scores += s * s.transpose();
  }
  const double nb = static_cast<double>(f.blocks);
  const Eigen::MatrixXd robust = inverse * scores * inverse * (nb > 1.0 ? nb / (nb - 1.0) : 1.0);
  const Eigen::VectorXd back = scale.cwiseInverse();
  f.c = back.cwiseProduct(c);
  f.covariance = back.asDiagonal() * robust * back.asDiagonal();
  f.u = (inverse.diagonal() * s2).cwiseMax(robust.diagonal()).cwiseSqrt().cwiseProduct(back);
  return f;
}

Eigen::VectorXd left_out_errors(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, const std::vector<int>& block) {
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(y.size());
  for (const auto& b : members(block)) {
    const auto rest = X.rows() - static_cast<Eigen::Index>(b.size());
    Eigen::MatrixXd A(rest, X.cols());
    Eigen::VectorXd z(rest);
    Eigen::Index k = 0;
    for (Eigen::Index i = 0; i < X.rows(); ++i) {
      if (std::binary_search(b.begin(), b.end(), i)) continue;
      A.row(k) = X.row(i);
      z(k++) = y(i);
    }
    const Eigen::VectorXd c = fit_in_blocks(A, z, std::vector<int>(static_cast<std::size_t>(rest), 0)).c;
    for (const auto i : b) errors(i) = y(i) - X.row(i).dot(c);
  }
  return errors;
}

RmsReduction rms_reduction(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const std::vector<int>& block, std::uint64_t seed) {
  const auto blocks = members(block);
  std::vector<double> b2, a2;
  for (const auto& b : blocks) {
    b2.push_back(0.0);
    a2.push_back(0.0);
    for (const auto i : b) {
      b2.back() += before(i) * before(i);
      a2.back() += after(i) * after(i);
    }
  }
  const RandomStream random(seed, kResamplingModule);
  std::uint64_t sample = 0;
  std::vector<double> falls;
  for (int r = 0; r < kResamples; ++r) {
    double sb = 0.0, sa = 0.0;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      const auto pick =
          std::min(blocks.size() - 1, static_cast<std::size_t>(random.uniform(sample++) * static_cast<double>(blocks.size())));
      sb += b2[pick];
      sa += a2[pick];
    }
    falls.push_back(sb > 0.0 ? 1.0 - std::sqrt(sa / sb) : 0.0);
  }
  std::sort(falls.begin(), falls.end());
  const double b = rms_of(before);
  return {b > 0.0 ? 1.0 - rms_of(after) / b : 0.0, falls[static_cast<std::size_t>(0.025 * kResamples)],
          falls[static_cast<std::size_t>(0.975 * kResamples)]};
}

}  // namespace rotorloop
