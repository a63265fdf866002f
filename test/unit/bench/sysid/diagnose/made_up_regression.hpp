// Regressions whose answers are known, as the table of a screening.
#pragma once
#include <cmath>
#include <vector>

#include "bench/sysid/diagnose/score_table.hpp"
#include "host/base/random.hpp"

namespace rotorloop::diagnose::made_up {

using Index = ScoreTable::Index;

// y = Σ columns θ + noise of unit variance, in blocks of `per_block` samples; the table stands at θ = 0.
struct Regression {
  std::vector<std::vector<double>> columns;
  std::vector<double> y;
  std::size_t base = 1, per_block = 50;

  ScoreTable table() const {
    const auto n = static_cast<Index>(columns.size());
    ScoreTable t;
    t.base = static_cast<Index>(base);
    t.information = Eigen::MatrixXd::Zero(n, n);
    t.score = Eigen::VectorXd::Zero(n);
    t.measurements = static_cast<double>(y.size());
    std::vector<Index> all;
    for (Index i = 0; i < n; ++i) all.push_back(i);
    for (std::size_t from = 0; from + per_block <= y.size(); from += per_block) {
      ScoreTable::Block b{0,   static_cast<double>(from),   static_cast<double>(from + per_block),
                          all, Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
      const auto rows = static_cast<Index>(per_block);
      Eigen::MatrixXd x(rows, n);
      for (Index i = 0; i < n; ++i) x.col(i) = Eigen::Map<const Eigen::VectorXd>(columns[static_cast<std::size_t>(i)].data() + from, rows);
      b.information = x.transpose() * x;
      b.score = -x.transpose() * Eigen::Map<const Eigen::VectorXd>(y.data() + from, rows);
      t.information += b.information;
      t.score += b.score;
      t.fold.push_back(static_cast<int>(t.blocks.size() / 4 % 5));
      t.blocks.push_back(std::move(b));
    }
    return t;
  }
};

inline constexpr std::size_t kSamples = 3000;

inline std::vector<double> noise(std::uint64_t seed, std::uint64_t module) {
  const RandomStream random(seed, module);
  std::vector<double> out(kSamples);
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = random.gaussian(k);
  return out;
}
// First-order process of unit variance that remembers `memory` of its last value.
inline std::vector<double> coloured(std::uint64_t seed, std::uint64_t module, double memory) {
  std::vector<double> out = noise(seed, module);
  for (std::size_t k = 1; k < out.size(); ++k) out[k] = memory * out[k - 1] + std::sqrt(1.0 - memory * memory) * out[k];
  return out;
}

}  // namespace rotorloop::diagnose::made_up
