// Linear least squares row by row, by Givens rotations: float is enough, as no square of the matrix is ever formed
// (Golub, Van Loan, Matrix Computations, ch. 5). No heap, N unknowns.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

namespace rotorloop::firmware {

template <std::size_t N>
struct LeastSquares {
  std::array<std::array<float, N + 1>, N> r{};  // upper triangle and right-hand side
  std::size_t rows = 0;

  void add(const std::array<float, N>& x, float y) {
    std::array<float, N + 1> row{};
    for (std::size_t k = 0; k < N; ++k) row[k] = x[k];
    row[N] = y;
    for (std::size_t k = 0; k < N; ++k) {
      const float size = std::sqrt(r[k][k] * r[k][k] + row[k] * row[k]);
      if (!(size > 0.0f)) continue;
      const float c = r[k][k] / size, s = row[k] / size;
      for (std::size_t j = k; j <= N; ++j) {
        const float turned = c * r[k][j] + s * row[j];
        row[j] = c * row[j] - s * r[k][j];
        r[k][j] = turned;
      }
    }
    ++rows;
  }

  // False when the rows do not tell the unknowns apart. Columns should be of like size.
  bool solve(std::array<float, N>& out) const {
    for (std::size_t n = N; n-- > 0;) {
      if (!(r[n][n] > 1e-4f * r[0][0])) return false;
      float rest = r[n][N];
      for (std::size_t j = n + 1; j < N; ++j) rest -= r[n][j] * out[j];
      out[n] = rest / r[n][n];
    }
    return true;
  }
};

}  // namespace rotorloop::firmware
