// At which frequencies the model lacks a wrench, and which input moves with it there: Welch's estimate of power density, power by
// band beside what noise of the fitted figures gives, and coherence with every input.
#pragma once
#include <span>

#include "bench/sysid/diagnose/residuals/samples.hpp"

namespace rotorloop::diagnose {

struct SpectrumBand {
  double from_Hz = 0.0, to_Hz = 0.0;
  double rms = 0.0;           // of the residual in this band
  double rms_expected = 0.0;  // mean over noise by the figures of the fit: nothing is missing
};
struct InputCoherence {
  std::size_t input = 0;  // index among the inputs
  double from_Hz = 0.0, to_Hz = 0.0, coherence = 0.0;
  double chance = 0.0;  // level that unrelated series pass in 1 % of all the pairs of this table together
};
struct AxisSpectrum {
  std::vector<double> density, density_expected;  // one-sided, unit²/Hz, at Spectra::frequency_Hz
  std::vector<SpectrumBand> bands;
  std::vector<InputCoherence> coherence;  // above chance, largest first
};
struct Spectra {
  std::vector<double> frequency_Hz;
  std::size_t segments = 0;
  std::array<AxisSpectrum, kAxes> axis;
};

struct SpectrumOptions {
  double segment_s = 2.5;  // rounded to a power of two samples, halves overlap
  std::vector<double> edges_Hz{0.0, 0.5, 2.0, 5.0, 10.0, 25.0, 1e9};
};

// Flights with the same step only: those whose step differs from the first piece's are left out. No segment: everything is empty.
Spectra spectra(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                const SpectrumOptions& options = {});

}  // namespace rotorloop::diagnose
