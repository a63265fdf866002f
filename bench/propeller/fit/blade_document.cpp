#include "bench/propeller/fit/blade_document.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

namespace rotorloop::propeller {
namespace {

using Json = nlohmann::ordered_json;

Json share(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }

Json errors(const ErrorRms& e) { return {{"rows", e.rows}, {"ct_rms", share(e.ct)}, {"cp_rms", share(e.cp)}}; }

Json geometry_document(const GeometryResult& g, bool taken) {
  Json scalars = Json::array(), sets = Json::array();
  const auto parameters = blade_parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k)
    scalars.push_back({{"name", parameters[k].name},
                       {"value", g.fit.values[k]},
                       {"standard_error", g.fit.at_bound[k] ? Json(nullptr) : share(g.fit.standard_errors[k])},
                       {"at_bound", static_cast<bool>(g.fit.at_bound[k])}});
  for (const SetScore& x : g.scores)
    sets.push_back({{"label", x.label},
                    {"static", x.is_static},
                    {"part", x.part == Part::fitted ? "fitted" : "held_out"},
                    {"whole_sweep", x.whole},
                    {"judged", x.judged},
                    {"unfitted", errors(x.unfitted)},
                    {"fitted", errors(x.fitted)}});
  return {{"source", g.source}, {"taken", taken}, {"misfit_rms", share(g.fit.rms)}, {"scalars", scalars}, {"errors", sets}};
}

}  // namespace

std::string blade_fit_json(const BladeFit& f, const std::vector<std::pair<std::filesystem::path, std::string>>& written,
                           const std::string& version) {
  Json files = Json::array(), polars = Json::array(), geometries = Json::array();
  for (const auto& [path, text] : written) files.push_back(path.generic_string());
  for (const auto& [name, p] : f.polars) {
    Json reynolds = Json::array();
    for (const auto& t : p.polar.tables) reynolds.push_back(t.reynolds);
    polars.push_back({{"section", name},
                      {"from", p.kind},
                      {"source", p.polar.source},
                      {"cached", p.cached},
                      {"reynolds", reynolds},
                      {"remarks", p.remarks}});
  }
  for (const PropellerResult& r : f.result)
    for (std::size_t i = 0; i < r.geometries.size(); ++i) geometries.push_back(geometry_document(r.geometries[i], i == f.best));
  const Json d{{"format", 1},
               {"kind", "blade_fit"},
               {"rotorloop", version},
               {"name", f.title},
               {"fitted", f.fitted},
               {"verdict", holds(f) ? "fitted" : "unfitted"},
               {"misses", f.misses},
               {"sweeps_held_out", f.sweeps_held_out},
               {"sweeps_within", f.sweeps_within},
               {"files", files},
               {"section",
                {{"inner", f.section.inner},
                 {"outer", f.section.outer.empty() ? Json(nullptr) : Json(f.section.outer)},
                 {"reason", f.section.reason}}},
               {"polars", polars},
               {"blades", f.blade.blades},
               {"radius_m", f.blade.radius_m},
               {"blade_inertia_kg_m2", f.inertia_kg_m2},
               {"inertia_estimated", f.inertia_estimated},
               {"geometries", geometries},
               {"remarks", f.remarks}};
  return d.dump(2) + "\n";
}

}  // namespace rotorloop::propeller
