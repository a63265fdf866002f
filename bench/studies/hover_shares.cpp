#include "bench/studies/hover_shares.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "host/base/statistics.hpp"

namespace rotorloop::studies {
namespace {

constexpr double kLevel_m_s = 0.15;
constexpr std::size_t kLeastHoverSamples = 200;
constexpr double kFull = 0.9999;
// Thrust goes with motor voltage to this power near hover: the map from thrust to voltage of Crazyflie firmware, -0.0006239 t² + 0.088 t
// with t the thrust of all four in gf, has the slope 0.63 in logarithms at 38 gf.
constexpr double kThrustPerVoltage = 1.58;
constexpr double kSwayStep_Hz = 0.05;
constexpr double kSwayStretch_s = 1.0 / kSwayLow_Hz;  // one period of the slowest
constexpr double kSwayGap_s = 0.5;

double held_value(const log::Stream<double>& s, double t_s) {
  const auto it = std::upper_bound(s.t_s.begin(), s.t_s.end(), t_s);
  return s.value[it == s.t_s.begin() ? 0 : static_cast<std::size_t>(it - s.t_s.begin()) - 1];
}

struct Heights {
  std::vector<double> t_s, z_m, climb_m_s;
};
Heights heights_of(const log::FlightRecord& f) {
  Heights h;
  const bool pose = !f.pose.empty();
  const std::size_t n = pose ? f.pose.size() : f.position_W_m.size();
  for (std::size_t i = 0; i < n; ++i) {
    h.t_s.push_back(pose ? f.pose.t_s[i] : f.position_W_m.t_s[i]);
    h.z_m.push_back(pose ? f.pose.value[i].p_W_m.z() : f.position_W_m.value[i].z());
  }
  h.climb_m_s.assign(n, 0.0);
  for (std::size_t i = 10; i + 10 < n; ++i) h.climb_m_s[i] = (h.z_m[i + 10] - h.z_m[i - 10]) / (h.t_s[i + 10] - h.t_s[i - 10]);
  return h;
}

double channel(const log::RotorValues& demand, std::size_t k) {
  // Rotors 1 front right, 2 rear left, 3 front left, 4 rear right; 1 and 2 turn alike. Signs do not matter to an rms.
  constexpr double kSign[4][4] = {{1, 1, 1, 1}, {-1, 1, 1, -1}, {1, -1, 1, -1}, {-1, -1, 1, 1}};
  double sum = 0.0;
  for (std::size_t r = 0; r < 4; ++r) sum += 0.25 * kSign[k][r] * demand[r];
  return sum;
}

// Mean square in the band times the length of the stretch, by Hann-windowed Fourier sums about a straight line.
double band_energy(std::vector<double> y, double span_s) {
  const double n = static_cast<double>(y.size()), dt = span_s / (n - 1.0);
  const double mean = std::accumulate(y.begin(), y.end(), 0.0) / n;
  double slope = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double x = dt * static_cast<double>(i) - 0.5 * span_s;
    slope += x * (y[i] - mean);
    squares += x * x;
  }
  slope /= squares;
  double energy = 0.0;
  for (double hz = kSwayLow_Hz; hz < kSwayHigh_Hz; hz += kSwayStep_Hz) {
    double re = 0.0, im = 0.0;
    for (std::size_t i = 0; i < y.size(); ++i) {
      const double x = dt * static_cast<double>(i) - 0.5 * span_s, w = 1.0 + std::cos(2.0 * std::numbers::pi * x / span_s);
      const double v = w * (y[i] - mean - slope * x), angle = 2.0 * std::numbers::pi * hz * x;
      re += v * std::cos(angle);
      im += v * std::sin(angle);
    }
    // |Σ w y|² dt² is a density times span times the window's mean square, 3/2.
    energy += 2.0 * (re * re + im * im) * dt * dt / 1.5 * kSwayStep_Hz;
  }
  return energy;
}

void add_sway(HoverShare& s, const std::vector<double>& t_s, const std::vector<log::RotorValues>& demand) {
  std::array<double, 4> energy{};
  for (std::size_t a = 0, b = 0; a < t_s.size(); a = b) {
    b = a + 1;
    while (b < t_s.size() && t_s[b] - t_s[b - 1] < kSwayGap_s) ++b;
    const double span = t_s[b - 1] - t_s[a];
    if (span < kSwayStretch_s) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      std::vector<double> y;
      for (std::size_t i = a; i < b; ++i) y.push_back(channel(demand[i], k));
      energy[k] += band_energy(std::move(y), span);
    }
    s.sway_s += span;
  }
  if (s.sway_s <= 0.0) return;
  const double mean = channel(s.demand, kTotalDemand);
  for (std::size_t k = 0; k < 4; ++k) s.sway[k] = std::sqrt(energy[k] / s.sway_s) / mean;
}

}  // namespace

std::optional<HoverShare> hover_share(const log::FlightRecord& f, CommandMeaning meaning) {
  const Heights h = heights_of(f);
  if (h.t_s.empty() || f.motor_command.empty() || (meaning == CommandMeaning::duty && f.battery_V.empty())) return std::nullopt;
  const double usual = quantile(h.z_m, 0.75), ground = *std::min_element(h.z_m.begin(), h.z_m.end());
  HoverShare s;
  s.flight = f.name;
  std::vector<double> hover_t_s;
  std::vector<log::RotorValues> demand;
  std::size_t k = 0;
  double full = 0.0;
  for (std::size_t i = 0; i < h.t_s.size(); ++i) {
    if (h.z_m[i] < ground + 0.8 * (usual - ground) || std::abs(h.climb_m_s[i]) > kLevel_m_s) continue;
    while (k + 1 < f.motor_command.size() && f.motor_command.t_s[k + 1] <= h.t_s[i]) ++k;
    log::RotorValues u = f.motor_command.value[k];
    const double volts = f.battery_V.empty() ? 0.0 : held_value(f.battery_V, h.t_s[i]);
    if (*std::min_element(u.begin(), u.end()) <= 0.0) continue;
    full += *std::max_element(u.begin(), u.end()) >= kFull;
    for (std::size_t r = 0; r < 4; ++r) {
      if (meaning == CommandMeaning::duty) u[r] = std::pow(u[r] * volts, kThrustPerVoltage);
      s.demand[r] += u[r];
    }
    s.battery_V += volts;
    hover_t_s.push_back(h.t_s[i]);
    demand.push_back(u);
  }
  s.samples = hover_t_s.size();
  if (s.samples < kLeastHoverSamples) return std::nullopt;
  for (auto& d : s.demand) d /= static_cast<double>(s.samples);
  s.battery_V /= static_cast<double>(s.samples);
  s.saturated = full / static_cast<double>(s.samples);
  add_sway(s, hover_t_s, demand);
  return s;
}

CommandMeaning command_meaning(const std::vector<log::FlightRecord>& reference) {
  const auto spread = [&](CommandMeaning m) {
    std::vector<double> totals;
    for (const auto& f : reference)
      if (const auto s = hover_share(f, m)) totals.push_back(std::log(channel(s->demand, kTotalDemand)));
    if (totals.size() < 2) return 1e300;
    const double mean = std::accumulate(totals.begin(), totals.end(), 0.0) / static_cast<double>(totals.size());
    double squares = 0.0;
    for (const double t : totals) squares += (t - mean) * (t - mean);
    return squares;
  };
  return spread(CommandMeaning::duty) < spread(CommandMeaning::thrust) ? CommandMeaning::duty : CommandMeaning::thrust;
}

}  // namespace rotorloop::studies
