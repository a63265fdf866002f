#include "bench/propeller/fit/blade_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/propeller/fit/section_rule.hpp"
#include "bench/propeller/section_blade.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kNylon_kg_m3 = 1150.0;  // moulded propellers; carbon is a third heavier and thinner
constexpr double kSectionArea = 0.68;    // of chord times thickness, four-digit sections
constexpr double kUsualThickness = 0.10;
constexpr std::size_t kFewestRows = 4;
// Where no file names the section its direction of zero lift is unknown as well: from -1 degree of nearly flat sections to -7 of strongly
// cambered ones (Eppler 63), where the assumed NACA 4410 has -4.
constexpr double kUnknownZeroLift_deg = 3.0;
constexpr double kUnfittedReynolds = 2e5;  // no row says how far tables must go

// ∫ ρ A r² dr of all blades.
double solid_inertia_kg_m2(const PropellerGeometry& g) {
  double sum = 0.0;
  for (std::size_t i = 1; i < g.stations.size(); ++i) {
    const auto &a = g.stations[i - 1], &b = g.stations[i];
    const auto area = [](const GeometryStation& s) {
      return kSectionArea * s.thickness_ratio.value_or(kUsualThickness) * s.chord_m * s.chord_m;
    };
    sum += 0.5 * (area(a) * a.r_m * a.r_m + area(b) * b.r_m * b.r_m) * (b.r_m - a.r_m);
  }
  return kNylon_kg_m3 * sum * g.blades;
}

void judge_sets(const GeometryResult& g, BladeFit& out) {
  for (const SetScore& s : g.scores) {
    if (s.part != Part::held_out || !s.judged || s.fitted.rows == 0) continue;
    const double ct_most = s.is_static ? kStaticThrustMost : kVerdictThrustMost,
                 cp_most = s.is_static ? kStaticPowerMost : kVerdictPowerMost;
    const std::size_t before = out.misses.size();
    const auto check = [&](const char* what, double error, double most) {
      if (!(error <= most))
        out.misses.push_back(fmt::format("{} of {}: {:.1f} %, allowed {:g} %", what, s.label, 100.0 * error, 100.0 * most));
    };
    check("C_T", s.fitted.ct, ct_most);
    check("C_P", s.fitted.cp, cp_most);
    const bool within = out.misses.size() == before;
    if (s.is_static) {
      out.static_within = out.static_within && within;
    } else if (s.whole) {  // the other rows of the fitted sweep are of the same day, speed and instrument as those that were fitted
      ++out.sweeps_held_out;
      out.sweeps_within += within;
    }
  }
}

// A scalar at its bound hides that something else is wrong.
void name_bounds(const GeometryResult& g, std::vector<std::string>& remarks) {
  const auto parameters = blade_parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k)
    if (g.fit.at_bound[k])
      remarks.push_back(
          fmt::format("{} stands at its bound of {:g}: perhaps another geometry, section, diameter or number of blades than "
                      "was measured",
                      parameters[k].name, g.fit.values[k]));
}

}  // namespace

BladeFit fit_any_blade(const PropellerFiles& files, const PropellerInputs& given, const std::string& title) {
  PropellerInputs inputs = given;
  BladeFit out;
  out.title = title;
  out.remarks = files.remarks;
  out.section = section_by_rule(files, inputs);
  // Once for all geometries: making polars takes a minute.
  for (const std::string& name : {out.section.inner, out.section.outer})
    if (!name.empty() && !inputs.ready.contains(name)) inputs.ready.emplace(name, read_section(inputs, name));
  out.polars = inputs.ready;
  const PropellerGeometry& first = files.geometries.front().geometry;
  for (const NamedGeometry& g : files.geometries)
    if (g.geometry.inertia_kg_m2) out.inertia_kg_m2 = *g.geometry.inertia_kg_m2;
  if (out.inertia_kg_m2 == 0.0) {
    out.inertia_kg_m2 = solid_inertia_kg_m2(first);
    out.inertia_estimated = true;
  }
  // The maker's own predictions are a model's: nothing is fitted to them, and they are scored beside the rest.
  const bool measured = !files.sets.empty() && files.sets.front().label == "static" && files.sets.front().rows.size() >= kFewestRows;
  if (!measured) {
    out.blade = to_blade(inputs, first, out.section, kUnfittedReynolds);
    out.blade.blade_inertia_kg_m2 = out.inertia_kg_m2;
    return out;
  }
  MeasuredPropeller p;
  p.entry.title = title;
  p.entry.diameter_m = files.diameter_m;
  p.entry.blades = first.blades;
  p.entry.judged = true;
  p.entry.section = out.section;
  if (!first.sections && inputs.section.empty()) p.entry.pitch_bound_deg += kUnknownZeroLift_deg;
  p.sets = files.sets;
  p.sets.front().fitted = true;
  if (const std::size_t sweep = sweep_to_fit(p.sets, inputs.fit_rpm); sweep > 0) p.sets[sweep].fitted = true;
  for (const NamedGeometry& g : files.geometries)
    p.geometries.push_back({g.source, to_blade(inputs, g.geometry, out.section, largest_reynolds(g.geometry, p.sets, files.diameter_m))});
  out.result.push_back(validate(p));
  const auto& geometries = out.result.front().geometries;
  out.best = static_cast<std::size_t>(
      std::min_element(geometries.begin(), geometries.end(), [](const auto& a, const auto& b) { return a.fit.rms < b.fit.rms; }) -
      geometries.begin());
  out.blade = geometries[out.best].fitted_blade;
  out.fitted = true;
  judge_sets(geometries[out.best], out);
  name_bounds(geometries[out.best], out.remarks);
  out.blade.blade_inertia_kg_m2 = out.inertia_kg_m2;
  return out;
}

bool holds(const BladeFit& f) { return f.fitted && f.static_within && 3 * f.sweeps_within >= 2 * f.sweeps_held_out; }

std::string verdict_text(const BladeFit& f) {
  if (holds(f)) return f.misses.empty() ? "fitted" : fmt::format("fitted, but not for {}", fmt::join(f.misses, "; "));
  return "unfitted: " + (f.fitted ? fmt::format("{}", fmt::join(f.misses, "; ")) : std::string("there are no measurements"));
}

std::string blade_fit_text(const BladeFit& f) {
  std::string s = fmt::format("{}: section {}{}: {}\n", f.title, f.section.inner, f.section.outer.empty() ? "" : " to " + f.section.outer,
                              f.section.reason);
  const auto percent = [](double v) { return std::isnan(v) ? std::string("–") : fmt::format("{:.1f}", 100.0 * v); };
  if (!f.fitted)
    s += "UNFITTED: there are no measurements; expect 3 to 13 % of static thrust and 6 to 28 % of static power, and much more near zero "
         "thrust\n";
  if (f.fitted)
    s += fmt::format(
        "VERDICT {}{}\n", verdict_text(f),
        holds(f)
            ? fmt::format(": held-out static rows within {:g} and {:g} % (C_T, C_P), {} of {} sweeps held out whole within {:g} and {:g} %",
                          100.0 * kStaticThrustMost, 100.0 * kStaticPowerMost, f.sweeps_within, f.sweeps_held_out,
                          100.0 * kVerdictThrustMost, 100.0 * kVerdictPowerMost)
            : "");
  for (const PropellerResult& r : f.result)
    for (std::size_t i = 0; i < r.geometries.size(); ++i) {
      const GeometryResult& g = r.geometries[i];
      s += fmt::format("  geometry {}{}:", g.source, i == f.best ? " (taken: the smaller misfit)" : "");
      const auto parameters = blade_parameters();
      for (std::size_t k = 0; k < parameters.size(); ++k)
        s += fmt::format("{} {} {:.2f}{}", k == 0 ? "" : ",", parameters[k].name, g.fit.values[k],
                         g.fit.at_bound[k] ? " (bound)" : fmt::format(" ± {:.2f}", g.fit.standard_errors[k]));
      s += fmt::format("; misfit {:.1f} %\n  {:<30}{:>4}  {:>14}  {:>14}\n  {:<34}  {:>7} {:>6}  {:>7} {:>6}\n", 100.0 * g.fit.rms,
                       "rms error, %", "rows", "unfitted", "fitted", "", "C_T", "C_P", "C_T", "C_P");
      for (const SetScore& x : g.scores)
        s += fmt::format("  {:<14}{:<16}{:>4}  {:>7} {:>6}  {:>7} {:>6}\n", x.label,
                         x.part == Part::fitted ? "fitted"
                         : x.whole              ? "held out whole"
                                                : "held out",
                         x.fitted.rows, percent(x.unfitted.ct), percent(x.unfitted.cp), percent(x.fitted.ct), percent(x.fitted.cp));
    }
  for (const auto& [name, p] : f.polars) {
    s += fmt::format("  polars of {}: {}{}\n", name, p.polar.source, p.cached ? " (kept from before)" : "");
    for (const auto& r : p.remarks) s += "    " + r + "\n";
  }
  for (const auto& r : f.remarks) s += "  " + r + "\n";
  return s;
}

}  // namespace rotorloop::propeller
