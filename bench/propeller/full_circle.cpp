#include "bench/propeller/full_circle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kDragMost = 1.20;       // broadside: 1.11 + 0.018 * aspect ratio (Viterna), blade aspect ratio about 5
constexpr double kReversedLift = 0.7;    // of a section flown tail first, relative to the forward one
constexpr double kReversedDrag = 2.0;    // at zero angle, relative to the forward one: the blunt nose is at the back
constexpr double kWidestHole_deg = 5.0;  // between computed points; the branch around zero ends at a wider one
constexpr double kFineTo_deg = 30.0, kFineStep_deg = 0.5, kCoarseStep_deg = 5.0;  // XFLR5's own step; Viterna is smooth

double radians(double deg) { return deg * 3.14159265358979323846 / 180.0; }

// The stretch of computed points around zero without a wide hole.
struct Core {
  std::vector<double> alpha_deg, cl, cd;

  explicit Core(const SectionPolar& p) {
    const auto& a = p.alpha_deg;
    std::size_t low = 0;
    while (low + 1 < a.size() && a[low + 1] <= 0.0) ++low;
    std::size_t high = low;
    while (low > 0 && a[low] - a[low - 1] <= kWidestHole_deg) --low;
    while (high + 1 < a.size() && a[high + 1] - a[high] <= kWidestHole_deg) ++high;
    const auto take = [&](const std::vector<double>& v) {
      return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(low), v.begin() + static_cast<std::ptrdiff_t>(high) + 1);
    };
    alpha_deg = take(a);
    cl = take(p.cl);
    cd = take(p.cd);
  }
  sim::SectionCoefficients at(double alpha) const {
    const auto upper = std::upper_bound(alpha_deg.begin() + 1, alpha_deg.end() - 1, alpha);
    const auto i = static_cast<std::size_t>(upper - alpha_deg.begin());
    const double w = (alpha - alpha_deg[i - 1]) / (alpha_deg[i] - alpha_deg[i - 1]);
    return {cl[i - 1] + w * (cl[i] - cl[i - 1]), cd[i - 1] + w * (cd[i] - cd[i - 1])};
  }
};

// Beyond the core on one side, alpha in [match, 180] with lift counted positive.
sim::SectionCoefficients beyond(double alpha_deg, double match_deg, sim::SectionCoefficients at_match, double cd_zero) {
  if (alpha_deg <= 90.0) return viterna(match_deg, at_match.cl, at_match.cd, alpha_deg);
  const double mirrored = 180.0 - alpha_deg;
  auto c = viterna(match_deg, at_match.cl, at_match.cd, std::max(mirrored, match_deg));
  c.cl *= -kReversedLift;
  if (mirrored < match_deg) {
    const double w = mirrored / match_deg;
    c = {w * c.cl, w * c.cd + (1.0 - w) * kReversedDrag * cd_zero};
  }
  return c;
}

std::vector<double> grid_deg() {
  std::vector<double> grid;
  for (double a = -180.0; a <= 180.0; a += std::fabs(a + 0.25) < kFineTo_deg ? kFineStep_deg : kCoarseStep_deg) grid.push_back(a);
  return grid;
}
}  // namespace

sim::SectionCoefficients viterna(double match_deg, double cl, double cd, double alpha_deg) {
  const double s = sin_exact(radians(match_deg)), c = cos_exact(radians(match_deg));
  const double a2 = (cl - kDragMost * s * c) * s / (c * c), b2 = (cd - kDragMost * s * s) / c;
  const double sa = sin_exact(radians(alpha_deg)), ca = cos_exact(radians(alpha_deg));
  return {kDragMost * sa * ca + a2 * ca * ca / sa, kDragMost * sa * sa + b2 * ca};
}

sim::Polar full_circle(std::vector<SectionPolar> polars) {
  const auto refuse = [](const std::string& what, const std::string& remedy) { throw Error({"polars of a section", what, "", remedy}); };
  if (polars.empty()) refuse("none given", "give one file for each Reynolds number");
  std::sort(polars.begin(), polars.end(), [](const SectionPolar& a, const SectionPolar& b) { return a.reynolds < b.reynolds; });
  sim::Polar result;
  result.source =
      fmt::format("XFOIL by XFLR5, {}, Ncrit {}, Viterna extension", polars.front().airfoil, number_text(polars.front().n_crit));
  result.alpha_deg = grid_deg();
  for (std::size_t i = 0; i < polars.size(); ++i) {
    const SectionPolar& p = polars[i];
    if (p.airfoil != polars.front().airfoil)
      refuse(fmt::format("airfoils \"{}\" and \"{}\" are mixed", polars.front().airfoil, p.airfoil), "give the files of one airfoil");
    if (i > 0 && !(p.reynolds > polars[i - 1].reynolds))
      refuse(fmt::format("Reynolds number {} is given twice", number_text(p.reynolds)), "give one file for each Reynolds number");
    const Core core(p);
    const double low = core.alpha_deg.front(), high = core.alpha_deg.back();
    if (!(low < 0.0 && high > 0.0))
      refuse(fmt::format("{} at Reynolds number {}: no points below zero", p.airfoil, number_text(p.reynolds)),
             "compute negative angles too");
    sim::PolarTable table{p.reynolds, {}, {}};
    for (const double a : result.alpha_deg) {
      sim::SectionCoefficients c{};
      if (a >= low && a <= high) {
        c = core.at(a);
      } else if (a > 0.0) {
        c = beyond(a, high, core.at(high), core.at(0.0).cd);
      } else {
        const auto at_low = core.at(low);
        c = beyond(-a, -low, {-at_low.cl, at_low.cd}, core.at(0.0).cd);
        c.cl = -c.cl;
      }
      table.cl.push_back(c.cl);
      table.cd.push_back(c.cd);
    }
    result.tables.push_back(std::move(table));
  }
  return result;
}

static bool alike(const sim::Polar& a, const sim::Polar& b) {
  bool same = a.alpha_deg == b.alpha_deg && a.tables.size() == b.tables.size();
  for (std::size_t i = 0; same && i < a.tables.size(); ++i) same = a.tables[i].reynolds == b.tables[i].reynolds;
  return same;
}

sim::Polar on_grid_of(const sim::Polar& like, sim::Polar polar) {
  if (alike(like, polar)) return polar;
  sim::Polar result{polar.source, like.alpha_deg, {}};
  for (const sim::PolarTable& t : like.tables) {
    sim::PolarTable table{t.reynolds, {}, {}};
    for (const double a : like.alpha_deg) {
      const sim::SectionCoefficients c = sim::polar_at(polar, a, t.reynolds);
      table.cl.push_back(c.cl);
      table.cd.push_back(c.cd);
    }
    result.tables.push_back(std::move(table));
  }
  return result;
}

sim::Polar blend(const sim::Polar& a, const sim::Polar& b, double weight) {
  sim::Polar result = a;
  if (!alike(a, b))
    throw Error({"polars of two sections", "angles or Reynolds numbers differ", "", "compute both at the same Reynolds numbers"});
  result.source =
      fmt::format("{} % of ({}), {} % of ({})", number_text(100.0 * (1.0 - weight)), a.source, number_text(100.0 * weight), b.source);
  for (std::size_t t = 0; t < a.tables.size(); ++t)
    for (std::size_t i = 0; i < a.alpha_deg.size(); ++i) {
      result.tables[t].cl[i] += weight * (b.tables[t].cl[i] - a.tables[t].cl[i]);
      result.tables[t].cd[i] += weight * (b.tables[t].cd[i] - a.tables[t].cd[i]);
    }
  return result;
}

sim::Polar up_to(sim::Polar polar, double reynolds) {
  const auto first = std::find_if(polar.tables.begin(), polar.tables.end(), [&](const auto& t) { return t.reynolds >= reynolds; });
  if (first != polar.tables.end()) polar.tables.erase(first + 1, polar.tables.end());
  return polar;
}

}  // namespace rotorloop::propeller
