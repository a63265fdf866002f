#include "bench/hil/closed_loop/tracking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host/base/random.hpp"
#include "host/base/statistics.hpp"

namespace rotorloop::closed_loop {
namespace {

constexpr std::size_t kResamples = 20'000;
constexpr std::uint64_t kModule = 0x636C6F7365;  // "close": the same resampling for the same pairs, always

double mean(std::span<const double> v) { return std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size()); }

const hil::FlightResult* find(const hil::RunResult& r, const std::string& flight, std::uint64_t seed) {
  for (const auto& f : r.flights)
    if (f.flight == flight && f.seed == seed) return &f;
  return nullptr;
}

double error_cm(const hil::FlightResult& f, hil::ErrorAxis axis) {
  return axis == hil::ErrorAxis::z ? f.tracking.truth.mean_z_cm : f.tracking.truth.mean_3d_cm;
}

void judge(TrackedFlight& t) {
  const auto& r = t.reduction;
  const bool better = t.plan.expect == Expectation::better;
  const double limit = better ? t.plan.percent : -t.plan.percent;
  if (t.lost > 0) {
    t.reason = fmt::format("{} flights were lost that were completed before", t.lost);
  } else if (std::isnan(r.low)) {
    t.reason = "fewer than two pairs of flights";
  } else {
    t.pass = better ? r.low > limit : r.low >= limit;
    const std::string interval = fmt::format("{:.1f} % less error, 95 %: {:.1f} to {:.1f} %", r.percent, r.low, r.high);
    t.reason =
        better ? fmt::format("{}; wanted above {:g} %", interval, limit) : fmt::format("{}; allowed down to {:g} %", interval, limit);
  }
}

}  // namespace

PairedReduction paired_reduction(std::span<const double> before, std::span<const double> after) {
  PairedReduction out;
  out.pairs = before.size();
  if (out.pairs == 0) return out;
  out.percent = 100.0 * (1.0 - mean(after) / mean(before));
  if (out.pairs < 2) return out;
  const std::size_t n = out.pairs;
  const RandomStream random(n, kModule);
  std::vector<double> values(kResamples);
  std::uint64_t sample = 0;
  for (double& v : values) {
    double b = 0.0, a = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(random.uniform(sample++) * static_cast<double>(n));
      b += before[k];
      a += after[k];
    }
    v = 100.0 * (1.0 - a / b);
  }
  std::sort(values.begin(), values.end());
  const double dn = static_cast<double>(n);
  const double z = std::sqrt(dn / (dn - 1.0)) * student_quantile(0.95, dn - 1.0);
  const double tail = 0.5 * normal_two_sided(z);
  const auto at = static_cast<std::size_t>(tail * static_cast<double>(kResamples - 1));
  out.low = values[at];
  out.high = values[kResamples - 1 - at];
  // Resampling cannot show a scatter that few pairs do not have in them: Student's interval of the linearised ratio beside it.
  const double ratio = mean(after) / mean(before);
  double squares = 0.0;
  for (std::size_t i = 0; i < n; ++i) squares += (after[i] - ratio * before[i]) * (after[i] - ratio * before[i]);
  const double half = 100.0 * student_quantile(0.95, dn - 1.0) * std::sqrt(squares / (dn - 1.0) / dn) / mean(before);
  out.low = std::min(out.low, out.percent - half);
  out.high = std::min(100.0, std::max(out.high, out.percent + half));
  return out;
}

std::vector<TrackedFlight> compare_tracking(const std::vector<JudgedFlight>& plan, const hil::RunResult& before,
                                            const hil::RunResult* identified, const hil::RunResult& after) {
  std::vector<TrackedFlight> out;
  for (const JudgedFlight& p : plan) {
    TrackedFlight t;
    t.plan = p;
    for (const auto& b : before.flights) {
      if (b.flight != p.flight.name || b.end != hil::FlightEnd::completed) continue;
      const auto* a = find(after, b.flight, b.seed);
      if (!a || a->end != hil::FlightEnd::completed) {
        ++t.lost;
        continue;
      }
      const auto* i = identified ? find(*identified, b.flight, b.seed) : nullptr;
      t.seeds.push_back(b.seed);
      t.before.push_back(error_cm(b, p.axis));
      t.after.push_back(error_cm(*a, p.axis));
      if (i && i->end == hil::FlightEnd::completed) t.identified.push_back(error_cm(*i, p.axis));
    }
    if (t.identified.size() != t.before.size()) t.identified.clear();  // a lost flight would unpair the rest
    t.reduction = paired_reduction(t.before, t.after);
    if (!t.identified.empty()) t.reduction_identified = paired_reduction(t.before, t.identified);
    judge(t);
    out.push_back(std::move(t));
  }
  return out;
}

}  // namespace rotorloop::closed_loop
