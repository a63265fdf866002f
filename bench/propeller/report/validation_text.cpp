// The tables that `rotorloop rotor validate` prints, and its JSON.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/propeller/report/validation_output.hpp"

namespace rotorloop::propeller {
namespace {
using Json = nlohmann::ordered_json;

std::string percent_text(double v) { return std::isnan(v) ? "–" : fmt::format("{:.1f}", 100.0 * v); }

std::string part_text(const SetScore& s) { return s.part == Part::fitted ? "fitted" : s.whole ? "held out whole" : "held out"; }

Json to_json(const ErrorRms& e) {
  if (e.rows == 0) return nullptr;
  return {{"rows", e.rows}, {"ct", e.ct}, {"cp", e.cp}};
}

Json to_json(const GeometryResult& g) {
  Json scalars;
  const auto parameters = blade_parameters();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    Json u = std::isnan(g.fit.standard_errors[k]) ? Json(nullptr) : Json(g.fit.standard_errors[k]);
    scalars.push_back({{"name", parameters[k].name},
                       {"unit", parameters[k].unit},
                       {"value", g.fit.values[k]},
                       {"standard_error", std::move(u)},
                       {"at_bound", static_cast<bool>(g.fit.at_bound[k])}});
  }
  Json sets;
  for (const SetScore& s : g.scores)
    sets.push_back({{"set", s.label},
                    {"part", s.part == Part::fitted ? "fitted" : "held_out"},
                    {"held_out_whole", s.whole},
                    {"judged", g.judged && s.judged && s.part == Part::held_out},
                    {"unfitted", to_json(s.unfitted)},
                    {"fitted", to_json(s.fitted)}});
  return {{"source", g.source}, {"judged", g.judged}, {"misfit", g.fit.rms}, {"scalars", std::move(scalars)}, {"sets", std::move(sets)}};
}
}  // namespace

bool all_pass(const std::vector<ValidationLimit>& limits) {
  return std::all_of(limits.begin(), limits.end(), [](const ValidationLimit& l) { return l.pass; });
}

std::string validation_text(const ValidationDocument& d) {
  std::string out;
  const auto parameters = blade_parameters();
  for (const PropellerResult& p : d.results) {
    const auto& e = p.propeller.entry;
    out += fmt::format("{}: section {}{}{}\n", e.title, e.section.inner, e.section.outer.empty() ? "" : " to " + e.section.outer,
                       e.judged ? "" : "; printed only");
    for (const GeometryResult& g : p.geometries) {
      out += fmt::format("  geometry {}{}:", g.source, g.judged ? " (judged)" : "");
      for (std::size_t k = 0; k < parameters.size(); ++k)
        out += fmt::format("{} {} {:.2f}{}{}", k == 0 ? "" : ",", parameters[k].name, g.fit.values[k],
                           parameters[k].unit == "1" ? "" : " " + parameters[k].unit, g.fit.at_bound[k] ? " (bound)" : "");
      out += fmt::format("; misfit {:.1f} %\n  {:<30}{:>4}  {:>14}  {:>14}\n", 100.0 * g.fit.rms, "rms error, %", "rows", "unfitted",
                         "fitted");
      out += fmt::format("  {:<34}  {:>7} {:>6}  {:>7} {:>6}\n", "", "C_T", "C_P", "C_T", "C_P");
      for (const SetScore& s : g.scores)
        out += fmt::format("  {:<14}{:<16}{:>4}  {:>7} {:>6}  {:>7} {:>6}{}\n", s.label, part_text(s), s.fitted.rows,
                           percent_text(s.unfitted.ct), percent_text(s.unfitted.cp), percent_text(s.fitted.ct), percent_text(s.fitted.cp),
                           e.judged && !s.judged ? "  printed only" : "");
    }
    out += '\n';
  }
  out += fmt::format("{:<62}{:>9}  {:>8}\n", "limit on held-out rows", "measured", "allowed");
  for (const ValidationLimit& l : d.limits)
    out += fmt::format("{:<62}{:>7} %  {} {:>4} %  {}\n", l.name, percent_text(l.measured), l.at_least ? "≥" : "≤", percent_text(l.limit),
                       l.pass ? "pass" : "MISSED");
  return out;
}

std::string validation_json(const ValidationDocument& d) {
  Json j{{"format", 1},
         {"version", d.version},
         {"stall_drag", d.stall_drag},
         {"verdict", all_pass(d.limits) ? "pass" : "fail"},
         {"errors", Json::array()}};
  for (const ValidationLimit& l : d.limits)
    if (!l.pass) j["errors"].push_back("limit missed: " + l.name);
  for (const ValidationLimit& l : d.limits)
    j["limits"].push_back({{"name", l.name}, {"measured", l.measured}, {"limit", l.limit}, {"at_least", l.at_least}, {"pass", l.pass}});
  for (const PropellerResult& p : d.results) {
    const auto& e = p.propeller.entry;
    Json one{{"propeller", e.key}, {"title", e.title}, {"judged", e.judged}, {"section", e.section.inner}};
    if (!e.section.outer.empty()) one["outer_section"] = e.section.outer;
    for (const GeometryResult& g : p.geometries) one["geometries"].push_back(to_json(g));
    j["propellers"].push_back(std::move(one));
  }
  return j.dump(2) + "\n";
}

}  // namespace rotorloop::propeller
