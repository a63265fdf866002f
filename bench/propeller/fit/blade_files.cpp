#include "bench/propeller/fit/blade_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/base/toml_file.hpp"

namespace rotorloop::propeller {
namespace {

std::string list_text(const std::vector<double>& values, int decimals) {
  std::string s = "[";
  for (std::size_t i = 0; i < values.size(); ++i)
    s += fmt::format("{}{}{:.{}f}", i ? "," : "", i % 14 == 0 ? "\n  " : " ", values[i], decimals);
  return s + "]\n";
}

std::string plain_source(std::string text) {
  std::erase_if(text, [](char c) { return c == '"' || c == '\\'; });
  return text;
}

}  // namespace

std::string polar_file_text(const sim::Polar& p) {
  std::string s = fmt::format("format = 1\nsource = \"{}\"\nalpha_deg = {}", plain_source(p.source), list_text(p.alpha_deg, 1));
  for (const sim::PolarTable& t : p.tables)
    s += fmt::format("\n[[table]]\nreynolds = {}\ncl = {}cd = {}", number_text(t.reynolds), list_text(t.cl, 4), list_text(t.cd, 5));
  return s;
}

std::vector<std::pair<std::filesystem::path, std::string>> blade_files(const BladeFit& f, const std::filesystem::path& out,
                                                                       const std::string& written_by) {
  std::vector<std::pair<std::filesystem::path, std::string>> files;
  const std::filesystem::path polars = (out.parent_path() / ".." / "polars").lexically_normal();
  const auto name_of = [&](std::string key) {
    std::erase(key, '.');
    return out.stem().string() + "_" + key;
  };
  const sim::Blade& b = f.blade;
  std::string s = fmt::format("# {} by {}.\n", f.title, written_by);
  if (f.fitted) {
    s += fmt::format("# Verdict: {}.\n", verdict_text(f));
    const GeometryResult& g = f.result.front().geometries[f.best];
    s += fmt::format("# Four scalars fitted to every second static row{}; misfit {:.1f} %. Held out:\n",
                     std::any_of(g.scores.begin(), g.scores.end(), [](const SetScore& x) { return !x.is_static && x.part == Part::fitted; })
                         ? " and one sweep"
                         : "",
                     100.0 * g.fit.rms);
    for (const SetScore& x : g.scores)
      if (x.part == Part::held_out)
        s += fmt::format("#   {}: C_T {:.1f} %, C_P {:.1f} % rms of {} rows\n", x.label, 100.0 * x.fitted.ct, 100.0 * x.fitted.cp,
                         x.fitted.rows);
  } else {
    s += "# UNFITTED: geometry and polars alone, no measurement of this propeller.\n";
  }
  for (const auto& [name, p] : f.polars) {
    s += fmt::format("# Polars of {}: {}.\n", plain_source(name), plain_source(p.polar.source));
    for (const auto& r : p.remarks) s += fmt::format("#   {}\n", plain_source(r));
  }
  s += fmt::format("# Section {}: {}.\nformat = 1\nblades = {}\nradius_m = {}\nhub_radius_m = {}\n", f.section.inner,
                   plain_source(f.section.reason), b.blades, number_text(b.radius_m), number_text(b.hub_radius_m));
  s += fmt::format("blade_inertia_kg_m2 = {:.3g} # {}\n", f.inertia_kg_m2,
                   f.inertia_estimated ? "estimated: a solid nylon blade of this plan form (factor 1.5)" : "of the mould file");
  s += fmt::format("stall_delay = {}\nstall_drag = {}\ndrag_scale = {}\nlift_scale = {}\npitch_offset_deg = {}\n",
                   number_text(b.stall_delay), number_text(b.stall_drag), number_text(b.drag_scale), number_text(b.lift_scale),
                   number_text(b.pitch_offset_deg));
  // Radii in full: a rounded tip may lie beyond the radius, and a reader refuses it.
  for (const sim::BladeStation& t : b.stations)
    s += fmt::format("\n[[station]]\nr_m = {}\nchord_m = {:.5g}\ntwist_deg = {:.4g}\npolar = \"{}\"\n", number_text(t.r_m), t.chord_m,
                     t.twist_deg, name_of(t.polar));
  for (const auto& [key, polar] : b.polars) files.emplace_back(polars / (name_of(key) + ".toml"), polar_file_text(polar));
  files.emplace_back(out, s);
  return files;
}

}  // namespace rotorloop::propeller
