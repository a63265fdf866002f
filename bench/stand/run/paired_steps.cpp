#include "bench/stand/run/paired_steps.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "host/base/statistics.hpp"

namespace rotorloop::stand_run {
namespace {

// Coefficients of one block of neighbouring steps of one configuration, by wanted speed; zeros before and after, linear in time between.
std::map<double, double> coefficients(const std::vector<PairedStep>& s, std::size_t from, std::size_t to) {
  std::vector<const PairedStep*> zeros;
  for (std::size_t i = from; i < to; ++i)
    if (s[i].wanted_rad_s == 0.0) zeros.push_back(&s[i]);
  std::map<double, double> out;
  if (zeros.empty()) return out;
  const PairedStep &first = *zeros.front(), &last = *zeros.back();
  for (std::size_t i = from; i < to; ++i) {
    if (s[i].wanted_rad_s == 0.0 || !(s[i].omega_rad_s > 0.0)) continue;
    const double share = last.t_s > first.t_s ? (s[i].t_s - first.t_s) / (last.t_s - first.t_s) : 0.0;
    out[s[i].wanted_rad_s] = (s[i].load - first.load - share * (last.load - first.load)) / (s[i].omega_rad_s * s[i].omega_rad_s);
  }
  return out;
}

}  // namespace

std::optional<PairedDifference> paired_difference(const std::vector<PairedStep>& steps) {
  std::vector<std::pair<char, std::map<double, double>>> blocks;
  for (std::size_t from = 0; from < steps.size();) {
    std::size_t to = from + 1;
    while (to < steps.size() && steps[to].configuration == steps[from].configuration) ++to;
    if (auto c = coefficients(steps, from, to); !c.empty()) blocks.emplace_back(steps[from].configuration, std::move(c));
    from = to;
  }
  std::vector<double> shares;
  for (std::size_t i = 0; i + 1 < blocks.size(); ++i) {
    if (blocks[i].first != 'A' || blocks[i + 1].first != 'B') continue;
    double sum = 0.0, n = 0.0;
    for (const auto& [speed, a] : blocks[i].second)
      if (const auto b = blocks[i + 1].second.find(speed); b != blocks[i + 1].second.end() && a != 0.0) {
        sum += 1.0 - b->second / a;
        n += 1.0;
      }
    if (n > 0.0) shares.push_back(sum / n);
  }
  if (shares.size() < 2) return std::nullopt;
  PairedDifference out;
  out.pairs = shares.size();
  const double n = static_cast<double>(shares.size());
  for (const double v : shares) out.share += v / n;
  double squares = 0.0;
  for (const double v : shares) squares += (v - out.share) * (v - out.share);
  out.u = std::sqrt(squares / (n - 1.0) / n);
  const double half = student_quantile(0.95, n - 1.0) * out.u;
  out.low = out.share - half;
  out.high = out.share + half;
  return out;
}

}  // namespace rotorloop::stand_run
