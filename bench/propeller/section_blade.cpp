#include "bench/propeller/section_blade.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/propeller/full_circle.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kKinematicViscosity_m2_s = 1.81e-5 / 1.225;  // as the solve has it at sea level
}

SectionPolars read_section(const PropellerInputs& inputs, const std::string& name) {
  if (const auto ready = inputs.ready.find(name); ready != inputs.ready.end()) return ready->second;
  const bool digits = name.find_first_not_of("0123456789") == std::string::npos;
  if (inputs.make_polars && (digits || name.find_first_of("./") != std::string::npos)) return inputs.make_polars(name);
  const auto folder = inputs.data / "propellers" / "polars";
  std::vector<std::filesystem::path> files;
  std::error_code ec;
  for (const auto& f : std::filesystem::directory_iterator(folder, ec))
    if (f.path().filename().string().starts_with(name + "_Re")) files.push_back(f.path());
  if (files.empty()) {
    const auto shipped = inputs.shipped_polars / (name + ".toml");
    if (std::filesystem::is_regular_file(shipped, ec)) return {sim::read_polar(shipped), "shipped", {}};
    if (inputs.make_polars) return inputs.make_polars(name);
    throw Error({"section " + name, fmt::format("no {}/{}_Re*.txt and no {}", folder.generic_string(), name, shipped.generic_string()),
                 "a misspelt section, or the command was not started in the source folder", "give --polars FOLDER, or another --section"});
  }
  std::sort(files.begin(), files.end());
  std::vector<SectionPolar> polars;
  for (const auto& f : files) polars.push_back(read_xflr5_polar(TextFile::read(f)));
  return {full_circle(std::move(polars)), "measured_data", {}};
}

// The largest chord Reynolds number that any row reaches: section tables go no further.
double largest_reynolds(const PropellerGeometry& g, const std::vector<MeasuredSet>& sets, double diameter_m) {
  double most = 0.0;
  for (const MeasuredSet& set : sets)
    for (const MeasuredRow& row : set.rows)
      for (const GeometryStation& s : g.stations) {
        const double n = row.rpm / 60.0, tip = 2.0 * std::numbers::pi * n * s.r_m, axial = row.j * n * diameter_m;
        most = std::max(most, std::sqrt(tip * tip + axial * axial) * s.chord_m / kKinematicViscosity_m2_s);
      }
  return most;
}

sim::Blade to_blade(const PropellerInputs& inputs, const PropellerGeometry& g, const SectionChoice& section, double reynolds) {
  sim::Blade b;
  b.blades = g.blades;
  b.radius_m = g.radius_m;
  b.hub_radius_m = g.hub_radius_m;
  b.blade_inertia_kg_m2 = g.inertia_kg_m2.value_or(0.0);  // has no part in a steady state
  b.stall_drag = inputs.stall_drag;
  const sim::Polar inner = up_to(read_section(inputs, section.inner).polar, reynolds);
  const sim::Polar outer = section.outer.empty() ? inner : on_grid_of(inner, up_to(read_section(inputs, section.outer).polar, reynolds));
  for (const GeometryStation& s : g.stations) {
    const double x = s.r_m / g.radius_m;
    const double w = section.outer.empty() ? 0.0 : std::clamp((x - section.blend_from) / (section.blend_to - section.blend_from), 0.0, 1.0);
    const std::string key = fmt::format("{:.4f}", w);
    if (!b.polars.contains(key)) b.polars.emplace(key, w == 0.0 ? inner : w == 1.0 ? outer : blend(inner, outer, w));
    b.stations.push_back({s.r_m, std::max(s.chord_m, sim::kLeastChord_m), s.twist_deg, key});
  }
  return b;
}

}  // namespace rotorloop::propeller
