#include "bench/diagnose/residuals/fourier.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace rotorloop::diagnose {

void fourier(std::vector<std::complex<double>>& x) {
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {  // order of reversed bits
    std::size_t bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t half = 1; half < n; half *= 2) {
    std::vector<std::complex<double>> turn(half);
    for (std::size_t j = 0; j < half; ++j) {
      const double angle = -std::numbers::pi * static_cast<double>(j) / static_cast<double>(half);
      turn[j] = {std::cos(angle), std::sin(angle)};
    }
    for (std::size_t at = 0; at < n; at += 2 * half) {
      for (std::size_t j = 0; j < half; ++j) {
        const std::complex<double> a = x[at + j], b = x[at + j + half] * turn[j];
        x[at + j] = a + b;
        x[at + j + half] = a - b;
      }
    }
  }
}

std::vector<double> hann(std::size_t n) {
  std::vector<double> w(n);
  for (std::size_t i = 0; i < n; ++i) w[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n));
  return w;
}

}  // namespace rotorloop::diagnose
