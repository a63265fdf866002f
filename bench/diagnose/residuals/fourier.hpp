// Discrete Fourier transform of lengths that are powers of two, and the window that Welch's method wants.
#pragma once
#include <complex>
#include <vector>

namespace rotorloop::diagnose {

// In place, forward, no scaling: X_j = Σ x_n exp(-2πi jn/N). N must be a power of two.
void fourier(std::vector<std::complex<double>>& x);

// Hann window of n points, periodic.
std::vector<double> hann(std::size_t n);

}  // namespace rotorloop::diagnose
