#include "bench/sysid/diagnose/report/residual_sections.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "bench/render/document.hpp"
#include "bench/sysid/diagnose/report/residual_figures.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::diagnose {
namespace {

using Json = nlohmann::ordered_json;
using identify::text_of;
using identify::value_of;
using render::Cell;
using render::figure_text;
using render::left;
using render::Markup;
using render::Section;
using render::Table;

constexpr std::size_t kMostFigures = 6;

std::string num(const Json& v, const char* format = "{:.3g}", double factor = 1.0) { return figure_text(factor * value_of(v), format); }
std::string percent(const Json& share) { return figure_text(100.0 * std::max(0.0, value_of(share)), "{:.1f}"); }
Markup side_by_side(const std::string& drawings) { return {drawings.empty() ? "" : "<div class=\"two\">\n" + drawings + "</div>\n"}; }
std::string range_Hz(const Json& band) { return num(band.at("from_Hz")) + "–" + num(band.at("to_Hz")); }

Section power_section(const Json& tree, const ResidualFindings& f) {
  Section out{"Residual wrench", "wrench", {render::List{tree.at("words").get<std::vector<std::string>>()}}};
  out.blocks.push_back(
      render::Paragraph{"Force and torque that the model lacks, from a pass in which the measurements alone decide, averaged over 0.2 s "
                        "(bands and curves over "
                        "time: as they are). “Expected” is what the same pass makes of noise of the fitted figures; “predictable” the "
                        "share of the power that "
                        "smooth functions of the motion, rotors and time explain on flights or blocks that had no part in them.",
                        render::On::page});
  Table power{
      {left("residual"), left("unit"), {"rms"}, {"expected"}, {"predictable, %"}, {"by chance, %"}, {"in bursts, %"}, left("kind")}};
  Table coherent{{left("residual"), left("coherent with"), {"band, Hz"}, {"coherence"}, {"by chance 1 %"}}};
  for (const Json& band : tree.at("axes").front().at("bands")) power.columns.push_back({range_Hz(band) + " Hz"});
  for (const Json& a : tree.at("axes")) {
    power.rows.push_back({{text_of(a.at("axis")), text_of(a.at("unit")), Cell(num(a.at("rms")), "big"), num(a.at("rms_expected")),
                           percent(a.at("explainable_share")), percent(a.at("explainable_by_chance")), percent(a.at("burst_share")),
                           text_of(a.at("kind"))}});
    for (const Json& b : a.at("bands")) {
      const double expected = value_of(b.at("rms_expected"));
      power.rows.back().cells.push_back(expected > 0.0 ? num(b.at("rms"), "{:.2f}", 1.0 / expected) + " ×" : "–");
    }
    for (std::size_t i = 0; i < std::min<std::size_t>(3, a.at("coherent_with").size()); ++i) {
      const Json& c = a.at("coherent_with")[i];
      coherent.rows.push_back(
          {{text_of(a.at("axis")), text_of(c.at("name")), range_Hz(c), num(c.at("coherence"), "{:.2f}"), num(c.at("chance"), "{:.2f}")}});
    }
  }
  out.blocks.push_back(power);
  if (f.spectra.frequency_Hz.empty()) return out;
  std::string drawings;
  for (std::size_t a = 0; a < kAxes; ++a) drawings += spectrum_figure(f, a);
  out.blocks.push_back(side_by_side(drawings));
  if (coherent.rows.empty())
    out.blocks.push_back(render::Paragraph{"No input is coherent with it in any band beyond chance."});
  else
    out.blocks.push_back(coherent);
  return out;
}

Section dependence_section(const Json& tree, const ResidualFindings& f) {
  Section out{"What it depends on", "", {}};
  Table t{{left("input"), left("residual"), {"predictable, %"}, {"by chance, %"}}};
  std::string drawings, curves, maps;
  for (std::size_t i = 0, drawn = 0; i < tree.at("dependence").size() && t.rows.size() < 2 * kMostFigures; ++i) {
    const Json& d = tree.at("dependence")[i];
    const double share = value_of(d.at("share"));
    if (!(share > 2.0 * value_of(d.at("chance")) && share > 0.02)) continue;
    t.rows.push_back({{text_of(d.at("name")), text_of(d.at("axis")), percent(d.at("share")), percent(d.at("chance"))}});
    if (drawn++ < kMostFigures && !f.dependence.ranking[i].bins.empty()) drawings += dependence_figure(f, f.dependence.ranking[i]);
  }
  if (t.rows.empty()) {
    out.blocks.push_back(render::Paragraph{"No single input predicts any axis beyond chance."});
    return out;
  }
  std::size_t drawn = 0;
  for (std::size_t a = 0; a < kAxes; ++a) {
    if (f.unexplained.kind[a] != ResidualKind::systematic) continue;
    const auto& parts = f.unexplained.axis[a].explainable.curves;
    for (std::size_t i = 0; i < std::min<std::size_t>(2, parts.size()) && drawn < kMostFigures; ++i, ++drawn)
      curves += curve_figure(f, a, parts[i]);
  }
  for (const PlaceMap& m : f.dependence.maps) maps += place_figure(m);
  if (!curves.empty()) curves.insert(0, "<h3>Parts of the additive fit</h3>\n");
  if (!maps.empty()) maps.insert(0, "<h3>By place</h3>\n");
  out.blocks.insert(out.blocks.end(), {t, side_by_side(drawings), side_by_side(curves), side_by_side(maps)});
  return out;
}

Section lag_section(const Json& tree, const ResidualFindings& f) {
  Section out{"Does it lead or follow?", "", {}};
  for (const Json& l : tree.at("lag_findings")) out.blocks.push_back(render::Paragraph{text_of(l.at("words"))});
  if (out.blocks.empty()) out.blocks.push_back(render::Paragraph{"No axis leads or follows the model beyond its interval."});
  Table t{{left("axis"), {"lag, ms"}, {"95 %"}, {"share"}, {"at no lag"}, {"slope"}}};
  for (const Json& a : tree.at("axes")) {
    const Json& l = a.at("lag");
    const bool known = l.at("known");
    t.rows.push_back({{text_of(a.at("axis")), Cell(known ? num(l.at("lag_s"), "{:.1f}", 1e3) : "–", "big"),
                       known ? num(l.at("low_s"), "{:.1f}", 1e3) + " … " + num(l.at("high_s"), "{:.1f}", 1e3) : "not determined",
                       num(l.at("share")), num(l.at("share_at_zero")), num(l.at("slope"))}});
  }
  out.blocks.push_back(t);
  if (!f.lag.axis[0].tried_s.empty()) out.blocks.push_back(side_by_side(lag_figure(f, false) + lag_figure(f, true)));
  return out;
}

Section variance_section(const Json& tree) {
  Section out{"Does its scatter change?", "", {}};
  out.blocks.push_back(
      render::Paragraph{"Score of a variance that the model lacks, after the noise figures of each flight took their share. Sizes are one "
                        "step from zero: an order "
                        "of magnitude when large.",
                        render::On::page});
  Table t{{left("effect"),
           left("what would scatter"),
           {"t"},
           {"p (Holm)"},
           {"size"},
           {"u"},
           left("unit"),
           left("aliases (correlation)"),
           left("")}};
  for (const Json& e : tree.at("variance_effects")) {
    const std::string id = text_of(e.at("id"));
    t.rows.push_back({{id.empty() ? "no effect of the library" : id, text_of(e.at("what"))}});
    std::vector<Cell>& cells = t.rows.back().cells;
    if (e.contains("untested")) {
      cells.insert(cells.end(), {"–", "–", "–", "–", text_of(e.at("unit")), "not tested: " + text_of(e.at("untested")), ""});
      continue;
    }
    std::vector<std::string> aliases;
    for (const Json& alias : e.at("twins"))
      aliases.push_back(fmt::format("{} ({:.2f})", text_of(alias.at("id")), value_of(alias.at("correlation"))));
    cells.insert(cells.end(), {num(e.at("t"), "{:.2f}"), num(e.at("p_holm"), "{:.2g}"), num(e.at("size"), "{:.2g}"),
                               num(e.at("u"), "{:.1g}"), text_of(e.at("unit")), fmt::format("{}", fmt::join(aliases, ", ")),
                               Cell(e.at("found").get<bool>() ? "found" : "", "fail")});
  }
  out.blocks.push_back(t);
  return out;
}

Section steps_section(const Json& tree, const ResidualFindings& f) {
  Section out{"Does it change at a moment?", "", {}};
  const std::size_t small = f.steps.too_small.size();
  const std::string passing = fmt::format("{} {} less than {:.2g} N and {:.2g} N m rms", small,
                                          small == 1 ? "passes and makes" : "pass and make", f.steps.matters[0], f.steps.matters[3]);
  if (f.steps.events.empty()) {
    out.blocks.push_back(render::Paragraph{
        fmt::format("No step that matters in force, torque, thrust or centre of mass passes at 1 % over all flights and kinds{}.",
                    small == 0 ? "" : "; " + passing)});
    return out;
  }
  Table t{{left("effect"), left("flight"), {"at, s"}, left("parameter"), {"step"}, {"u"}, left("unit"), {"p (Holm)"}}};
  for (const Json& event : tree.at("steps_in_time")) {
    if (!event.at(0).at("matters").get<bool>()) continue;
    for (std::size_t i = 0; i < event.size(); ++i) {
      const Json& s = event[i];
      t.rows.push_back({{text_of(s.at("effect")), text_of(s.at("flight")), num(s.at("at_s"), "{:.1f}"), text_of(s.at("parameter")),
                         Cell(render::measured_figure(value_of(s.at("size")), value_of(s.at("u"))), "big"),
                         render::uncertainty_text(value_of(s.at("u"))), text_of(s.at("unit")), num(s.at("p_holm"), "{:.1e}")},
                        i == 0});
    }
  }
  std::string drawings;
  for (const auto& event : f.steps.events) drawings += step_figure(f, f.steps.steps[event.front()]);
  out.blocks.insert(out.blocks.end(), {t, side_by_side(drawings)});
  if (small > 0) out.blocks.push_back(render::Paragraph{"Too small to matter: " + passing + "."});
  return out;
}

Section telemetry_section(const Json& tree) {
  Section out{"Gyro and accelerometer against the model", "", {}};
  Table t{{left("stream"), left("flight"), left("unit")}};
  for (const char* what : {"mean", "rms", "assumed"}) t.columns.insert(t.columns.end(), {{std::string(what) + " x"}, {"y"}, {"z"}});
  t.columns.push_back(left(""));
  for (const Json& r : tree.at("telemetry")) {
    t.rows.push_back({{text_of(r.at("stream")), text_of(r.at("flight")), text_of(r.at("unit"))}});
    for (const char* what : {"mean", "rms", "assumed"}) {
      for (std::size_t a = 0; a < 3; ++a) t.rows.back().cells.push_back(r.at(what).is_null() ? "–" : num(r.at(what)[a]));
    }
    t.rows.back().cells.push_back(r.at("in_the_fit").get<bool>() ? "" : "not in the fit");
  }
  out.blocks.push_back(t);
  return out;
}

}  // namespace

render::Sections residual_sections(const Json& tree, const ResidualFindings& f) {
  std::string drawings;
  for (std::size_t i = 0; i < f.series.samples.flights.size(); ++i) drawings += wrench_figures(f, i) + burst_figure(f, i);
  render::Sections out{power_section(tree, f),      {"Over time", "", {Markup{drawings}}},
                       dependence_section(tree, f), lag_section(tree, f),
                       variance_section(tree),      steps_section(tree, f)};
  if (!tree.at("telemetry").empty()) out.push_back(telemetry_section(tree));
  return out;
}

}  // namespace rotorloop::diagnose
