#include "bench/propeller/polar/section_sweeps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bench/propeller/full_circle.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kLast_deg = 20.0, kFirst_deg = -12.0;  // XFOIL is asked so far; steady panel methods mean little beyond
constexpr int kStep_mdeg = 500;
constexpr int kHole_mdeg = 2000;
constexpr double kJump = 0.15;  // of lift in one step; potential flow has 0.055
constexpr int kPasses = 2;
constexpr int kRefinements[] = {1, 2, 5};            // smaller steps help a sweep over the stall that stopped early
constexpr double kLeastCovered_deg[] = {-1.0, 5.0};  // a propeller works there; a shorter branch is no polar

XfoilPoint at(const XfoilPoints& points, int alpha_mdeg) {
  const auto b = points.lower_bound(alpha_mdeg);
  if (b->first == alpha_mdeg) return b->second;
  const auto a = std::prev(b);
  const double w = static_cast<double>(alpha_mdeg - a->first) / (b->first - a->first);
  return {(1.0 - w) * a->second.cl + w * b->second.cl, (1.0 - w) * a->second.cd + w * b->second.cd};
}

void smooth(std::vector<double>& v) {
  const std::vector<double> before = v;
  for (std::size_t i = 1; i + 1 < v.size(); ++i) v[i] = (before[i - 1] + 2.0 * before[i] + before[i + 1]) / 4.0;
}

struct Branch {
  XfoilPoints points;
  SectionPolar polar;
  bool hung = false;
};

Branch sweep_both_ways(const Sweep& sweep, const SweepSettings& s, double reynolds) {
  Branch b;
  for (const double last_deg : {kLast_deg, kFirst_deg})
    for (const int refine : kRefinements) {
      const auto r = sweep({reynolds, s.n_crit, last_deg, std::copysign(1e-3 * kStep_mdeg / refine, last_deg), s.time_limit_s});
      b.hung = b.hung || r.hung;
      b.points.insert(r.points.begin(), r.points.end());  // points of the coarser sweep stay
      b.polar = branch_around_zero(b.points);
      if (!b.polar.alpha_deg.empty() && (last_deg == b.polar.alpha_deg.front() || last_deg == b.polar.alpha_deg.back())) break;
    }
  return b;
}

}  // namespace

SectionPolar branch_around_zero(const XfoilPoints& points) {
  std::vector<int> grid;
  for (const auto& [a, unused] : points)
    if (a % kStep_mdeg == 0) grid.push_back(a);
  SectionPolar p;
  if (grid.empty()) return p;
  const auto zero = std::min_element(grid.begin(), grid.end(), [](int a, int b) { return std::abs(a) < std::abs(b); });
  const auto follows = [&](int a, int last) {
    return std::abs(a - last) <= kHole_mdeg && std::abs(points.at(a).cl - points.at(last).cl) <= kJump * std::abs(a - last) / kStep_mdeg;
  };
  auto low = zero, high = zero;
  while (high + 1 != grid.end() && follows(high[1], *high)) ++high;
  while (low != grid.begin() && follows(low[-1], *low)) --low;
  for (int a = *low; a <= *high; a += kStep_mdeg) {
    const XfoilPoint c = at(points, a);
    p.alpha_deg.push_back(1e-3 * a);
    p.cl.push_back(c.cl);
    p.cd.push_back(c.cd);
  }
  for (int i = 0; i < kPasses; ++i) {
    smooth(p.cl);
    smooth(p.cd);
  }
  return p;
}

SectionResult polars_of_sweeps(const std::string& label, const std::string& version, const SweepSettings& s, const Sweep& sweep,
                               const std::function<void(const std::string&)>& said) {
  SectionResult out;
  std::vector<SectionPolar> polars;
  for (std::size_t i = 0; i < s.reynolds.size(); ++i) {
    Branch b = sweep_both_ways(sweep, s, s.reynolds[i]);
    const std::string at = fmt::format("Re {:.0f}", s.reynolds[i]);
    if (b.hung) {
      out.hung = true;
      out.remarks.push_back(
          fmt::format("{}: a sweep ended at its time limit, {} s; what had converged is used", at, number_text(s.time_limit_s)));
    }
    const auto& a = b.polar.alpha_deg;
    const std::string covers =
        a.empty() ? "nothing converged"
                  : fmt::format("{} points converged, used {} to {} deg", b.points.size(), number_text(a.front()), number_text(a.back()));
    if (said) said(fmt::format("xfoil {}, {} ({} of {}): {}", label, at, i + 1, s.reynolds.size(), covers));
    if (a.empty() || a.front() > kLeastCovered_deg[0] || a.back() < kLeastCovered_deg[1]) {
      out.remarks.push_back(fmt::format("{} is left out: {}, expected at least {} to {} deg", at, covers, number_text(kLeastCovered_deg[0]),
                                        number_text(kLeastCovered_deg[1])));
      continue;
    }
    b.polar.airfoil = label;
    b.polar.reynolds = s.reynolds[i];
    b.polar.n_crit = s.n_crit;
    polars.push_back(std::move(b.polar));
  }
  if (polars.empty())
    throw Error({"section " + label, "XFOIL converges at no Reynolds number", "a section with a kink, or points that are far apart",
                 "give more points near the leading edge, or another section"});
  out.polar = full_circle(std::move(polars));
  out.polar.source = fmt::format("XFOIL {}, {}, Ncrit {}, Mach 0, Viterna extension", version, label, number_text(s.n_crit));
  return out;
}

}  // namespace rotorloop::propeller
