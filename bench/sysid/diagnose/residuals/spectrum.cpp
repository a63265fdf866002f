#include "bench/sysid/diagnose/residuals/spectrum.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <unsupported/Eigen/FFT>

namespace rotorloop::diagnose {
namespace {

using Transform = std::vector<std::complex<double>>;  // non-negative frequencies of one segment

struct Segments {
  std::size_t length = 0;
  double step_s = 0.0;
  std::vector<std::size_t> first;
};

Segments segments_of(const Samples& samples, double segment_s) {
  Segments out;
  std::size_t longest = 0;
  for (const Piece& p : samples.pieces) {
    if (out.step_s == 0.0) out.step_s = p.step_s;
    if (p.step_s == out.step_s) longest = std::max(longest, p.count);
  }
  if (longest < 16) return out;
  const auto wanted = static_cast<std::size_t>(std::max(16.0, segment_s / out.step_s));
  out.length = std::bit_floor(std::min(std::bit_ceil(wanted), longest));
  for (const Piece& p : samples.pieces) {
    if (p.step_s != out.step_s) continue;
    for (std::size_t at = 0; at + out.length <= p.count; at += out.length / 2) out.first.push_back(p.first + at);
  }
  return out;
}

// Hann window of n points, periodic.
std::vector<double> hann(std::size_t n) {
  std::vector<double> w(n);
  for (std::size_t i = 0; i < n; ++i) w[i] = 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n));
  return w;
}

// All transforms of one series.
std::vector<Transform> transforms(const std::vector<double>& series, const Segments& s, const std::vector<double>& window) {
  const auto n = static_cast<double>(window.size());
  double squares = 0.0;
  for (const double w : window) squares += w * w;
  Eigen::FFT<double> fft(Eigen::default_fft_impl<double>(), Eigen::FFT<double>::HalfSpectrum);
  std::vector<Transform> out(s.first.size());
  for (std::size_t k = 0; k < s.first.size(); ++k) {
    const double* v = &series[s.first[k]];
    const double mean = std::accumulate(v, v + window.size(), 0.0) / n;
    std::vector<double> x(window.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = (v[i] - mean) * window[i];
    fft.fwd(out[k], x);
    // The mean stays in the lowest line, as mean²: a constant force is power that the model lacks.
    out[k][0] += mean * std::sqrt(n * squares);
  }
  return out;
}

std::vector<double> density(const std::vector<Transform>& all, const Segments& s, const std::vector<double>& window) {
  double squares = 0.0;
  for (const double w : window) squares += w * w;
  std::vector<double> out(s.length / 2 + 1, 0.0);
  for (const Transform& t : all) {
    for (std::size_t j = 0; j < out.size(); ++j) out[j] += std::norm(t[j]);
  }
  for (std::size_t j = 0; j < out.size(); ++j) {
    const double sides = j == 0 || j == s.length / 2 ? 1.0 : 2.0;
    out[j] *= sides * s.step_s / (squares * static_cast<double>(std::max<std::size_t>(1, all.size())));
  }
  return out;
}

// Lines whose frequency lies in [from, to).
std::pair<std::size_t, std::size_t> lines(const std::vector<double>& f, double from, double to) {
  const auto a = static_cast<std::size_t>(std::lower_bound(f.begin(), f.end(), from) - f.begin());
  const auto b = static_cast<std::size_t>(std::lower_bound(f.begin(), f.end(), to) - f.begin());
  return {a, b};
}

double rms_in(const std::vector<double>& density, std::size_t from, std::size_t to, double width_Hz) {
  double sum = 0.0;
  for (std::size_t j = from; j < to; ++j) sum += density[j] * width_Hz;
  return std::sqrt(sum);
}

// Of the sum over the lines of a band: a delay of a few ms turns the phase little inside it.
double coherence(const std::vector<Transform>& a, const std::vector<Transform>& b, std::size_t from, std::size_t to) {
  double best = 0.0;
  for (std::size_t j = from; j < to; ++j) {
    std::complex<double> cross = 0.0;
    double aa = 0.0, bb = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      cross += a[i][j] * std::conj(b[i][j]);
      aa += std::norm(a[i][j]);
      bb += std::norm(b[i][j]);
    }
    if (aa > 0.0 && bb > 0.0) best += std::norm(cross) / (aa * bb);
  }
  return to > from ? best / static_cast<double>(to - from) : 0.0;
}

}  // namespace

Spectra spectra(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                const SpectrumOptions& o) {
  Spectra out;
  const Segments s = segments_of(samples, o.segment_s);
  if (s.first.empty()) return out;
  const std::vector<double> window = hann(s.length);
  const double width_Hz = 1.0 / (s.step_s * static_cast<double>(s.length));
  out.segments = s.first.size();
  for (std::size_t j = 0; j <= s.length / 2; ++j) out.frequency_Hz.push_back(static_cast<double>(j) * width_Hz);
  std::vector<std::vector<Transform>> input_transforms;
  for (const Channel& c : inputs) input_transforms.push_back(transforms(c.value, s, window));
  // Halves overlap: with a Hann window two segments are worth 1.9 times one (Welch 1967: correlation 1/6 of neighbours).
  const double averages = static_cast<double>(s.first.size()) * 0.95;
  std::vector<std::pair<double, double>> bands;
  for (std::size_t b = 0; b + 1 < o.edges_Hz.size(); ++b) {
    const auto [from, to] = lines(out.frequency_Hz, o.edges_Hz[b], o.edges_Hz[b + 1]);
    if (to > from) bands.emplace_back(o.edges_Hz[b], std::min(o.edges_Hz[b + 1], out.frequency_Hz.back() + 0.5 * width_Hz));
  }
  const double pairs = static_cast<double>(kAxes * std::max<std::size_t>(1, inputs.size()) * bands.size());
  for (std::size_t a = 0; a < kAxes; ++a) {
    AxisSpectrum& x = out.axis[a];
    const std::vector<Transform> own = transforms(residual[a], s, window);
    x.density = density(own, s, window);
    x.density_expected.assign(x.density.size(), 0.0);
    for (const Axes& e : expected) {
      const std::vector<double> d = density(transforms(e[a], s, window), s, window);
      for (std::size_t j = 0; j < d.size(); ++j) x.density_expected[j] += d[j] / static_cast<double>(expected.size());
    }
    for (const auto& [low, high] : bands) {
      const auto [from, to] = lines(out.frequency_Hz, low, high);
      x.bands.push_back({low, high, rms_in(x.density, from, to, width_Hz), rms_in(x.density_expected, from, to, width_Hz)});
      if (averages < 8.0) continue;
      // A line's coherence of unrelated series passes 1 - α^(1/(n-1)) with chance α (Carter 1973); a mean over lines less often.
      const double lines_in = static_cast<double>(to - from);
      const double mean = 1.0 / averages, spread = mean / std::sqrt(lines_in / 1.5);
      const double line_level = 1.0 - std::pow(0.01 / pairs, 1.0 / (averages - 1.0));
      const double level = std::min(line_level, mean + 4.5 * spread + (line_level - mean) / lines_in);
      for (std::size_t i = 0; i < inputs.size(); ++i) {
        const double c = coherence(own, input_transforms[i], from, to);
        if (c > level) x.coherence.push_back({i, low, high, c, level});
      }
    }
    std::stable_sort(x.coherence.begin(), x.coherence.end(),
                     [](const InputCoherence& p, const InputCoherence& q) { return p.coherence > q.coherence; });
  }
  return out;
}

}  // namespace rotorloop::diagnose
