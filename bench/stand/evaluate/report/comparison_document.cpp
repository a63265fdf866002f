#include "bench/stand/evaluate/report/comparison_document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "bench/stand/evaluate/estimate/coefficient.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

using render::Cell;
using render::figure_text;
using render::left;

std::string verdict_kind(const PairComparison& p) {
  return p.verdict == ComparisonVerdict::equivalent ? "pass" : p.verdict == ComparisonVerdict::different ? "fail" : "";
}
std::string percent_number(double share) { return figure_text(100.0 * share, "{:.2f}"); }

render::Table values_table(const ComparisonDocument& d) {
  render::Table t{{left("static thrust coefficient"), {"c_t, N s²"}, {"u, %"}, {"95 %"}, left("")}};
  for (std::size_t i = 0; i < d.values.size(); ++i) {
    const Compared& v = d.values[i];
    const double half = coverage_factor(v.degrees) * v.u;
    t.rows.push_back({{v.name, Cell(render::measured_figure(v.value, v.u), "big"), percent_number(v.u / v.value),
                       figure_text(v.value - half) + " … " + figure_text(v.value + half), d.notes[i]}});
  }
  return t;
}

render::Table pairs_table(const ComparisonDocument& d) {
  render::Table t{{left("pair"), {"ln(a/b), %"}, {"u, %"}, {"95 %"}, {"|d|/u"}, {"E_n"}, left("verdict")}};
  for (const PairComparison& p : d.pairs)
    t.rows.push_back({{p.a + " / " + p.b, percent_number(p.d), percent_number(p.u), percent_number(p.low) + " … " + percent_number(p.high),
                       figure_text(p.z, "{:.1f}"), figure_text(p.e_n, "{:.2f}"), Cell(verdict_text(p), verdict_kind(p))}});
  return t;
}

render::Table causes_table(const ComparisonDocument& d) {
  render::Table t{{left("cause"), {"predicted, %"}, {"u, %"}, left("tested"), left("")}};
  for (const Attribution& a : d.causes)
    t.rows.push_back({{a.cause, percent_number(a.d), percent_number(a.u),
                       a.cause == "sum" ? ""
                       : a.tested       ? "yes"
                                        : "no",
                       a.note},
                      a.cause == "sum"});
  return t;
}

std::string interval_figure(const ComparisonDocument& d) {
  render::Plot p;
  p.title = "Static thrust coefficient with its 95 % interval";
  p.y_label = "c_t, 10⁻⁶ N s²";
  p.x_label = "";
  p.width_px = 640;
  p.height_px = 320;
  p.x_min = 0.5;
  p.x_max = static_cast<double>(d.values.size()) + 0.5;
  render::Series bars, dots;
  bars.width_px = 3.0;
  bars.colour = 1;
  dots.marker = render::Marker::dot;
  dots.colour = 0;
  for (std::size_t i = 0; i < d.values.size(); ++i) {
    const Compared& v = d.values[i];
    const double x = static_cast<double>(i + 1), half = coverage_factor(v.degrees) * v.u;
    p.x_names.push_back(v.name);
    dots.x.push_back(x);
    dots.y.push_back(1e6 * v.value);
    bars.x.insert(bars.x.end(), {x, x, std::numeric_limits<double>::quiet_NaN()});
    bars.y.insert(bars.y.end(), {1e6 * (v.value - half), 1e6 * (v.value + half), std::numeric_limits<double>::quiet_NaN()});
  }
  p.series = {bars, dots};
  return render::figure_html(p.title, render::plot_svg(p));
}

render::Sections sections(const ComparisonDocument& d, bool with_figures) {
  render::Section s{"Stand against flight", "comparison"};
  s.blocks.push_back(render::Paragraph{fmt::format("At {:.4g} kg/m³ and {:.0f} RPM; margin of equivalence {:.1f} %.", d.air_density_kg_m3,
                                                   d.omega_rad_s * kRpm_per_rad_s, 100.0 * d.margin)});
  s.blocks.push_back(values_table(d));
  if (with_figures) s.blocks.push_back(render::Markup{interval_figure(d)});
  s.blocks.push_back(pairs_table(d));
  s.blocks.push_back(render::List{d.remarks});
  render::Section why{"What could make the difference", "causes"};
  why.blocks.push_back(render::Paragraph{
      "Sizes that known causes predict for the first pair. Only those marked tested were measured; none is claimed to be the cause."});
  why.blocks.push_back(causes_table(d));
  return {s, why};
}

}  // namespace

bool any_differs(const ComparisonDocument& d) {
  return std::any_of(d.pairs.begin(), d.pairs.end(), [](const PairComparison& p) { return p.verdict == ComparisonVerdict::different; });
}

render::Outcome comparison_outcome(const ComparisonDocument& d) {
  render::Outcome o;
  if (d.pairs.empty()) return o;
  const PairComparison& first = d.pairs.front();
  o.verdict = verdict_text(first);
  o.standing = first.verdict == ComparisonVerdict::equivalent  ? render::Standing::good
               : first.verdict == ComparisonVerdict::different ? render::Standing::bad
                                                               : render::Standing::open;
  o.sentence = fmt::format("{} against {}: {:+.2f} %, 95 %: {:+.2f} to {:+.2f} %", first.a, first.b, 100.0 * first.d, 100.0 * first.low,
                           100.0 * first.high);
  o.next = first.verdict == ComparisonVerdict::different
               ? "look at the causes that are not tested, the arm below the rotor first: run alternately with and without it"
           : first.verdict == ComparisonVerdict::equivalent
               ? "use either value"
               : "lower the larger of the two uncertainties: the budget of the stand, or more flights with climb and descent";
  return o;
}

std::string comparison_text(const ComparisonDocument& d) {
  return render::terminal_text(sections(d, false)) + "\n" + render::outcome_text(comparison_outcome(d));
}

std::string comparison_page(const ComparisonDocument& d) {
  return render::page_begin("Thrust stand against flight", "static thrust coefficient", "rotorloop") +
         render::banner_html(comparison_outcome(d)) + render::page_html(sections(d, true)) +
         render::page_html({{"Provenance", "provenance", {render::Paragraph{d.version}}}}) + render::page_end();
}

std::string comparison_json(const ComparisonDocument& d) {
  using Json = nlohmann::ordered_json;
  const render::Outcome o = comparison_outcome(d);
  Json j{{"format", 1},
         {"command", "stand compare"},
         {"version", d.version},
         {"verdict", o.verdict},
         {"next", o.next},
         {"air_density_kg_m3", d.air_density_kg_m3},
         {"rpm", d.omega_rad_s * kRpm_per_rad_s},
         {"margin", d.margin}};
  j["values"] = Json::array();
  j["pairs"] = Json::array();
  j["causes"] = Json::array();
  for (std::size_t i = 0; i < d.values.size(); ++i)
    j["values"].push_back({{"name", d.values[i].name},
                           {"c_t_N_s2", d.values[i].value},
                           {"u_N_s2", d.values[i].u},
                           {"degrees_of_freedom", d.values[i].degrees},
                           {"note", d.notes[i]}});
  for (const PairComparison& p : d.pairs) {
    Json one{{"a", p.a},
             {"b", p.b},
             {"log_ratio", p.d},
             {"u", p.u},
             {"interval_95", {p.low, p.high}},
             {"z", p.z},
             {"e_n", p.e_n},
             {"significant", p.significant},
             {"verdict", p.verdict == ComparisonVerdict::different    ? "different"
                         : p.verdict == ComparisonVerdict::equivalent ? "equivalent"
                                                                      : "cannot_tell"}};
    if (p.verdict == ComparisonVerdict::cannot_tell) one["needed_u"] = p.needed_u;
    j["pairs"].push_back(std::move(one));
  }
  for (const Attribution& a : d.causes)
    j["causes"].push_back({{"cause", a.cause}, {"predicted", a.d}, {"u", a.u}, {"tested", a.tested}, {"note", a.note}});
  j["remarks"] = d.remarks;
  return j.dump(2) + "\n";
}

}  // namespace rotorloop::stand
