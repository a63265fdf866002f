#include "bench/diagnose/residuals/spectrum.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>

#include "bench/diagnose/residuals/fourier.hpp"

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

// Two real series by one transform: the second rides in the imaginary part.
std::pair<Transform, Transform> transform(const double* a, const double* b, const std::vector<double>& window) {
  const std::size_t n = window.size();
  double mean_a = 0.0, mean_b = 0.0;
  for (std::size_t i = 0; i < n; ++i) mean_a += a[i], mean_b += b ? b[i] : 0.0;
  mean_a /= static_cast<double>(n), mean_b /= static_cast<double>(n);
  // The mean stays in the lowest line: a constant force is power that the model lacks.
  std::vector<std::complex<double>> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = {(a[i] - mean_a) * window[i], b ? (b[i] - mean_b) * window[i] : 0.0};
  fourier(x);
  std::pair<Transform, Transform> out;
  double squares = 0.0;
  for (const double w : window) squares += w * w;
  for (std::size_t j = 0; j <= n / 2; ++j) {
    const std::complex<double> p = x[j], q = std::conj(x[(n - j) % n]);
    out.first.push_back(0.5 * (p + q));
    out.second.push_back(std::complex<double>(0.0, -0.5) * (p - q));
  }
  const double level = std::sqrt(static_cast<double>(n) * squares);  // so that line 0 holds mean²
  out.first[0] += mean_a * level;
  out.second[0] += mean_b * level;
  return out;
}

// All transforms of one series.
std::vector<Transform> transforms(const std::vector<double>& series, const Segments& s, const std::vector<double>& window) {
  std::vector<Transform> out;
  for (std::size_t i = 0; i < s.first.size(); i += 2) {
    const bool pair = i + 1 < s.first.size();
    auto both = transform(&series[s.first[i]], pair ? &series[s.first[i + 1]] : nullptr, window);
    out.push_back(std::move(both.first));
    if (pair) out.push_back(std::move(both.second));
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
