#include "bench/propeller/fit/section_rule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/propeller/xflr5_polar.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kWorkingSection = 0.75;                                            // of the radius
constexpr double kClarkYCamber = 3.43, kClarkYThickness = 11.7, k4412Camber = 4.0;  // % of chord
constexpr double kHole_deg = 2.0;  // between computed angles from -8 to 8 degrees: near zero thrust sections work below 0

double thickness_at(const PropellerGeometry& g, double share) {
  const double r = share * g.radius_m;
  for (std::size_t i = 1; i < g.stations.size(); ++i)
    if (g.stations[i].r_m >= r) return 100.0 * g.stations[i].thickness_ratio.value_or(0.12);
  return 12.0;
}

// Do the computed points of any Reynolds number leave a hole?
bool has_hole(const PropellerInputs& inputs, const std::string& name) {
  std::error_code ec;
  for (const auto& f : std::filesystem::directory_iterator(inputs.data / "propellers" / "polars", ec)) {
    if (!f.path().filename().string().starts_with(name + "_Re")) continue;
    const SectionPolar p = read_xflr5_polar(TextFile::read(f.path()));
    for (std::size_t i = 1; i < p.alpha_deg.size(); ++i)
      if (p.alpha_deg[i] > -8.0 && p.alpha_deg[i - 1] < 8.0 && p.alpha_deg[i] - p.alpha_deg[i - 1] > kHole_deg) return true;
  }
  return false;
}

bool available(const PropellerInputs& inputs, const std::string& name) {
  std::error_code ec;
  for (const auto& f : std::filesystem::directory_iterator(inputs.data / "propellers" / "polars", ec))
    if (f.path().filename().string().starts_with(name + "_Re")) return true;
  return std::filesystem::is_regular_file(inputs.shipped_polars / (name + ".toml"), ec) ||
         (inputs.can_make_polars && inputs.can_make_polars(name));
}

struct Named {
  std::string polar, reason;
};
Named polar_for(const std::string& section, const PropellerGeometry& g) {
  if (section == "APC12") return {"naca4412", "APC12 is equivalent to NACA 4412"};
  if (section == "E63") return {"eppler_e63", "E63"};
  if (section == "CLARK-Y") {
    const double t = thickness_at(g, kWorkingSection), camber = kClarkYCamber * t / kClarkYThickness;
    const bool clark = std::abs(camber - kClarkYCamber) < std::abs(camber - k4412Camber);
    return {clark ? "clark_y" : "naca4412", fmt::format("CLARK-Y scaled to {:.1f} % thickness at 0.75 R has {:.1f} % camber", t, camber)};
  }
  return {"naca4412", "unknown section " + section};
}

}  // namespace

SectionChoice section_by_rule(const PropellerFiles& files, const PropellerInputs& inputs) {
  if (!inputs.section.empty()) return {.inner = inputs.section, .outer = "", .reason = "asked for"};
  const auto mould = std::find_if(files.geometries.begin(), files.geometries.end(),
                                  [](const NamedGeometry& g) { return g.geometry.sections.has_value(); });
  if (mould == files.geometries.end())
    return {.inner = "naca4410", .outer = "", .reason = "the geometry names no section: the one that the shipped blade flies with"};
  const PropellerGeometry& g = mould->geometry;
  const NamedSections& s = *g.sections;
  Named inner = polar_for(s.inner, g), outer = polar_for(s.outer, g);
  const double working_m = kWorkingSection * g.radius_m;
  const bool inner_works = working_m < s.blend_to_m;
  if (!available(inputs, inner.polar)) inner = {outer.polar, "no polars of " + inner.polar + ": " + outer.reason};
  if (inner_works && has_hole(inputs, inner.polar))
    inner = {outer.polar,
             fmt::format("polars of {} have a hole between -8 and 8 degrees, and it works at 0.75 R: {}", inner.polar, outer.reason)};
  if (inner.polar == outer.polar) return {.inner = inner.polar, .outer = "", .reason = inner.reason};
  // The blend runs over shares of the nominal radius.
  const double radius_m = std::round(g.radius_m / 0.000254) * 0.000254;
  return {.inner = inner.polar,
          .outer = outer.polar,
          .blend_from = s.blend_from_m / radius_m,
          .blend_to = s.blend_to_m / radius_m,
          .reason = inner.reason + " runs into " + outer.reason};
}

}  // namespace rotorloop::propeller
