#include "bench/sysid/identify/report/identify_sections.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/render/document.hpp"
#include "bench/render/page.hpp"
#include "bench/sysid/identify/report/held_out_sections.hpp"
#include "bench/sysid/identify/report/report_figures.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::identify {
namespace {

using Json = nlohmann::ordered_json;
using render::Cell;
using render::Column;
using render::figure_text;
using render::left;
using render::Markup;
using render::On;
using render::Paragraph;
using render::Section;
using render::Table;
using render::uncertainty_text;

std::string num(const Json& of, const char* key, const char* format = "{:.4g}") { return figure_text(value_of(of.at(key)), format); }
std::string two(const Json& of, const char* key) { return render::measured_u(value_of(of.at(key))); }
std::string u_of(const Json& of, const char* key = "u") { return uncertainty_text(value_of(of.at(key))); }
double largest_u(const Json& of) { return std::max(value_of(of.at("u")), value_of(of.at("u_robust"))); }
std::string reported_u(const Json& of) { return uncertainty_text(largest_u(of)); }
// The value under `key` with the digits that an uncertainty allows.
std::string measured(const Json& of, const char* key, double u) { return render::measured_figure(value_of(of.at(key)), u); }
std::string measured(const Json& of, const char* key = "value") { return measured(of, key, value_of(of.at("u"))); }
std::string unit_of(const Json& of) { return render::unit_text(text_of(of.at("unit"))); }
Cell p_cell(const Json& of) { return p_text(value_of(of.at("p"))); }

// Red only where the file knows: to move away from a guess is what a fit is for.
Cell z_cell(const Json& said) {
  constexpr double kDiffers = 2.0;
  return {num(said, "z", "{:.1f}"), std::fabs(value_of(said.at("z"))) > kDiffers && said.at("origin") != "guess" ? "fail" : ""};
}

// Long names of terms' parameters break after the term, or they push the last columns off the page.
std::string symbol(const Json& row) {
  std::string text = text_of(row.at("label"));
  if (const auto dot = text.find('.'); dot != std::string::npos) text.insert(dot + 1, "\n");
  return text;
}

std::string quaternion(const Json& q) {
  return fmt::format("{}, {}, {}, {}", figure_text(q[0], "{:.6f}"), figure_text(q[1], "{:.6f}"), figure_text(q[2], "{:.6f}"),
                     figure_text(q[3], "{:.6f}"));
}

Section parameters_section(const Json& tree) {
  Section out{"Parameters", "parameters", {}};
  out.blocks.push_back(Paragraph{
      "u is the larger of the classical uncertainty and the one that holds for correlated residuals; “model error” marks a parameter whose "
      "robust uncertainty is 5 times the classical one or more: it is biased by what the model lacks. “held” was not estimated. z compares "
      "with what the vehicle file said before (a dash: no vehicle file says that), red beyond 2 where that was no guess.",
      On::page});
  Table t{
      {left("parameter"), {"estimate"}, {"u"}, {"classical"}, {"robust"}, left("unit"), left(""), {"file said"}, left("origin"), {"z"}}};
  const auto add = [&](const Json& row, std::vector<Cell> own, const std::string& mark) {
    std::vector<Cell> cells{symbol(row)};
    cells.insert(cells.end(), own.begin(), own.end());
    cells.insert(cells.end(), {unit_of(row), Cell(mark, mark == "model error" ? "fail" : "")});
    const Json& file = row.at("file");
    if (file.is_null()) {
      cells.insert(cells.end(), {"–", "–", "–"});
    } else {
      cells.insert(cells.end(),
                   {render::value_text(value_of(file.at("value")), value_of(file.at("u")), "1"), text_of(file.at("origin")), z_cell(file)});
    }
    t.rows.push_back({cells});
  };
  for (const Json& e : tree.at("estimates"))
    add(e, {Cell(measured(e, "value", largest_u(e)), "big"), reported_u(e), two(e, "u"), two(e, "u_robust")}, text_of(e.at("mark")));
  for (const Json& h : tree.at("held")) add(h, {num(h, "value", "{:.5g}"), "", "", ""}, "held");
  out.blocks.push_back(t);
  if (!tree.at("q_BS_wxyz").is_null())
    out.blocks.push_back(Paragraph{fmt::format(
        "q_BS,x to z are the rotation vector of the sensor about the start value ({}). The quaternion itself, sensor to body, w x y z: {}.",
        quaternion(tree.at("start_q_BS_wxyz")), quaternion(tree.at("q_BS_wxyz")))});
  return out;
}

Section derived_section(const Json& tree) {
  Table t{{left("quantity"), {"value"}, {"u"}, {"u classical"}, {"u robust"}, left("unit"), left("meaning")}};
  for (const Json& d : tree.at("derived"))
    t.rows.push_back({{text_of(d.at("symbol")), Cell(measured(d, "value", largest_u(d)), "big"), reported_u(d), two(d, "u"),
                       two(d, "u_robust"), unit_of(d), text_of(d.at("meaning"))}});
  return {"Derived quantities", "", {t}};
}

// One table for each file, and one of static thrust.
void add_comparisons(const Json& tree, render::Sections& out) {
  for (const Json& file : tree.at("beside")) {
    const bool first = &file == &tree.at("beside").front();
    Section s{"Comparison with " + text_of(file.at("file")), first ? "beside" : "", {}};
    if (first)
      s.blocks.push_back(
          Paragraph{"The difference is how far these flights lie above the file, z the same in standard uncertainties of the difference "
                    "where the file "
                    "gives one; red beyond 2 where the file does not guess. What follows from a file's values has no u of its own.",
                    On::page});
    Table t{{left("parameter"), {"these flights"}, left("unit"), {"file"}, {"u"}, left("origin"), {"difference, %"}, {"z"}}};
    for (const Json& p : file.at("parameters")) {
      const bool held = p.at("held");
      t.rows.push_back({{text_of(p.at("label")), Cell(num(p, "found", "{:.5g}") + (held ? " (held)" : ""), held ? "" : "big"), unit_of(p),
                         measured(p), u_of(p), text_of(p.at("origin")), num(p, "percent", "{:+.1f}"), z_cell(p)}});
    }
    for (const Json& d : file.at("derived"))
      t.rows.push_back({{text_of(d.at("symbol")), Cell(num(d, "found", "{:.5g}"), "big"), unit_of(d), num(d, "value"), "", "",
                         num(d, "percent", "{:+.1f}"), ""},
                        &d == &file.at("derived").front()});
    s.blocks.push_back(t);
    out.push_back(s);
  }
  if (tree.at("static_thrust").empty()) return;
  const Json* found = nullptr;
  for (const Json& d : tree.at("derived")) {
    if (d.at("id") == "static_c_t") found = &d;
  }
  if (!found) return;
  Section s{"Static thrust of these flights compared with other measurements", tree.at("beside").empty() ? "beside" : "", {}};
  s.blocks.push_back(
      Paragraph{fmt::format("These flights: c_t {} {} {}. Entries of the files, at the air density of the start file; the "
                            "difference is how far these flights lie above.",
                            measured(*found, "value", largest_u(*found)), reported_u(*found), unit_of(*found))});
  Table t{{left("file"), left("origin"), {"c_t"}, {"u"}, left("unit"), {"difference, %"}, {"z"}, {"speeds, RPM"}}};
  for (const Json& e : tree.at("static_thrust"))
    t.rows.push_back(
        {{text_of(e.at("file")), text_of(e.at("origin")), measured(e), u_of(e), unit_of(*found), Cell(num(e, "percent", "{:+.2f}"), "big"),
          z_cell(e), fmt::format("{:.0f} … {:.0f}", value_of(e.at("rpm_window")[0]), value_of(e.at("rpm_window")[1]))}});
  s.blocks.push_back(t);
  out.push_back(s);
}

Section stages_section(const Json& tree) {
  Section out{"Stages compared with the joint fit", "stages", {}};
  out.blocks.push_back(
      Paragraph{"Each stage frees its own parameters on its own flight; what it holds counts with its uncertainty. z is the difference in "
                "uncertainties "
                "of the stage.",
                On::page});
  Table t{{left("stage"), left("parameter"), {"stage"}, {"u"}, {"held exact"}, {"joint fit"}, {"u"}, {"z"}, left("")}};
  std::string last;
  for (const Json& c : tree.at("stages")) {
    const std::string stage = text_of(c.at("stage"));
    const bool agrees = c.at("agrees"), first = stage != last;
    t.rows.push_back({{first ? stage : "", text_of(c.at("parameter")), measured(c), u_of(c), two(c, "u_alone"),
                       Cell(measured(c, "joint", value_of(c.at("u_joint"))), "big"), u_of(c, "u_joint"),
                       Cell(num(c, "z", "{:.1f}"), agrees ? "" : "fail"), Cell(agrees ? "" : "apart", "fail")},
                      first});
    last = stage;
  }
  out.blocks.push_back(t);
  return out;
}

Section noise_section(const Json& tree) {
  Section out{"Noise figures", "noise", {}};
  out.blocks.push_back(Paragraph{
      "q_a and q_α say how far the motion wanders from the model, as root densities of white acceleration along the world's axes and of "
      "angular acceleration about the body's; the others are standard deviations of one measurement. " +
          std::string(tree.at("conditions").at("noise") == "fixed" ? "They were given and kept (--noise fixed)."
                                                                   : "They were found together with the parameters."),
      On::page});
  constexpr const char* kFigures[][3] = {{"q_a_m_s2_rtHz", "q_a", "m/s²/√Hz"},   {"q_alpha_rad_s2_rtHz", "q_α", "rad/s²/√Hz"},
                                         {"position_m", "position", "m"},        {"attitude_rad", "attitude", "rad"},
                                         {"velocity_m_s", "velocity", "m/s"},    {"gyro_rad_s", "gyro", "rad/s"},
                                         {"accel_m_s2", "accelerometer", "m/s²"}};
  Table t{{left("flight"), left("figure"), {"x"}, {"y"}, {"z"}, left("unit")}};
  for (const Json& n : tree.at("noise")) {
    for (const auto& [key, figure, of_unit] : kFigures) {
      const Json& v = n.at(key);
      if (v.is_null()) continue;
      const bool first = key == kFigures[0][0];
      const std::string flight =
          fmt::format("{} ({:.0f} s at {:.4g} Hz)", text_of(n.at("flight")), value_of(n.at("seconds")), value_of(n.at("rate_Hz")));
      t.rows.push_back({{first ? flight : "", figure, figure_text(value_of(v[0]), "{:.3g}"), figure_text(value_of(v[1]), "{:.3g}"),
                         figure_text(value_of(v[2]), "{:.3g}"), of_unit},
                        first});
    }
  }
  out.blocks.push_back(t);
  return out;
}

void add_residuals(const Json& tree, const Identification& result, const IdentifyAnalysis& analysis, render::Sections& out) {
  out.push_back({"What the residuals say", "residuals", {}});
  if (tree.at("whiteness").empty()) {
    out.back().blocks.push_back(Paragraph{
        "Nothing: none of these flights has poses of position and attitude, and it is their innovations that are judged. A log with a pose "
        "stream fills this section."});
    return;
  }
  out.back().blocks.push_back(Paragraph{
      "Innovations: each pose minus its prediction from the past, in units of its predicted standard deviation. Under the model they are "
      "white "
      "and of unit size. The six channels are whitened in order, x, y, z, roll, pitch, yaw: each holds what those before it leave, so what "
      "disturbs several shows most in the first of them. A flight outside the band at short lags has noise that is not white; one outside "
      "at "
      "long lags moves in a way that the model lacks.",
      On::page});
  for (std::size_t f = 0; f < tree.at("whiteness").size(); ++f) {
    const Json& w = tree.at("whiteness")[f];
    Table t{{left("channel"), {"rms"}, {"Ljung–Box 0.1 s, p"}, {"0.5 s"}, {"2 s"}, {"runs, p"}, left("")}};
    for (const Json& c : w.at("channels")) {
      t.rows.push_back({{text_of(c.at("channel")), num(c, "rms", "{:.3f}")}});
      for (const Json& test : c.at("ljung_box")) t.rows.back().cells.push_back(p_cell(test));
      t.rows.back().cells.insert(t.rows.back().cells.end(),
                                 {p_cell(c.at("runs")), Cell(c.at("white").get<bool>() ? "" : "not white", "fail")});
    }
    out.push_back({text_of(w.at("flight")) + (w.at("white").get<bool>() ? ": white" : ": not white"), "", {t}});
    out.back().blocks.push_back(
        Markup{"<div class=\"two\">" + autocorrelation_figure(analysis.whiteness[f]) + cost_figure(analysis.whiteness[f]) + "</div>\n"});
  }
  for (std::size_t f = 0; f < result.flights.size(); ++f) {
    if (!result.fit.reduced[f].innovations.empty())
      out.back().blocks.push_back(Markup{innovation_figure(result.flights[f].name, result.fit.reduced[f].innovations)});
  }
}

Section homogeneity_section(const Json& h) {
  const double p = value_of(h.at("p")), inflation = value_of(h.at("inflation"));
  Section out{"Do the flights agree on one vehicle?", "flights", {}};
  out.blocks.push_back(Paragraph{fmt::format(
      "χ² {} on {:.0f} degrees of freedom, p {}{}. Below: each flight's own estimate of each shared parameter, all others free; a dash "
      "where "
      "the flight does not determine it. What moved may be freed for each flight (--per-flight).",
      num(h, "chi2", "{:.1f}"), value_of(h.at("degrees")), p < 1e-300 ? p_text(p) : "= " + p_text(p),
      inflation > 1.05 ? fmt::format(" (variances {} × the classical ones, for correlated residuals)", num(h, "inflation", "{:.1f}"))
                       : "")});
  Table t{{left("parameter")}};
  for (const Json& f : h.at("parameters").front().at("flights")) t.columns.push_back({text_of(f.at("flight"))});
  t.columns.insert(t.columns.end(), {Column{"p"}, left("")});
  for (const Json& q : h.at("parameters")) {
    t.rows.push_back({{text_of(q.at("parameter"))}});
    for (const Json& f : q.at("flights")) t.rows.back().cells.push_back(f.at("u").is_null() ? "–" : num(f, "value") + " " + u_of(f));
    t.rows.back().cells.insert(t.rows.back().cells.end(), {value_of(q.at("degrees")) > 0.0 ? p_cell(q) : Cell("–"),
                                                           Cell(q.at("moved").get<bool>() ? "moved" : "", "fail")});
  }
  out.blocks.push_back(t);
  return out;
}

Section observability_section(const Json& tree, const Identification& result) {
  const Json& o = tree.at("observability");
  Section out{"What these flights can and cannot determine", "observability", {}};
  out.blocks.push_back(
      Paragraph{fmt::format("Condition of the information, scaled to unit diagonal: {}. Weakest directions:", two(o, "condition"))});
  Table weakest{{{"information"}, left("direction")}};
  for (const Json& d : o.at("weakest")) {
    std::vector<std::string> parts;
    for (const Json& part : d.at("parts"))
      parts.push_back(fmt::format("{} ({:+.2f})", text_of(part.at("parameter")), value_of(part.at("share"))));
    weakest.rows.push_back({{two(d, "information"), fmt::format("{}", fmt::join(parts, ", "))}});
  }
  render::List pairs;
  for (const Json& c : o.at("correlated"))
    pairs.items.push_back(
        fmt::format("{} and {}: correlation {}", text_of(c.at("first")), text_of(c.at("second")), num(c, "correlation", "{:+.3f}")));
  Table advice{{left("parameter"), left("how it stands"), left("manoeuvre that determines it")}};
  for (const Json& a : o.at("advice"))
    advice.rows.push_back({{text_of(a.at("parameter")), text_of(a.at("why")), text_of(a.at("manoeuvre"))}});
  // Information per second, each parameter's largest set to 1: where each is learned.
  Table learned{{left("information per second, share of the best flight")}};
  render::List undetermined;
  for (const Json& f : o.at("flights")) {
    learned.columns.push_back({text_of(f.at("flight"))});
    if (!f.at("cannot_tell").empty() && o.at("flights").size() > 1)
      undetermined.items.push_back(fmt::format("{} alone ({:.0f} s) does not determine {}", text_of(f.at("flight")),
                                               value_of(f.at("seconds")),
                                               fmt::join(f.at("cannot_tell").get<std::vector<std::string>>(), ", ")));
  }
  for (std::size_t i = 0; i < o.at("parameters").size(); ++i) {
    const auto rate = [&](const Json& f) { return value_of(f.at("information")[i]) / std::max(value_of(f.at("seconds")), 1e-9); };
    double best = 0.0;
    for (const Json& f : o.at("flights")) best = std::max(best, rate(f));
    learned.rows.push_back({{text_of(o.at("parameters")[i])}});
    for (const Json& f : o.at("flights")) learned.rows.back().cells.push_back(best > 0.0 ? figure_text(rate(f) / best, "{:.3f}") : "–");
  }
  out.blocks.push_back(weakest);
  out.blocks.push_back(Markup{render::figure_html(
      "<b>Correlations</b> between the estimates; a pair above 0.9 is known as a combination only.", correlation_map(result))});
  out.blocks.push_back(pairs);
  if (!advice.rows.empty()) out.blocks.push_back(advice);
  out.blocks.insert(out.blocks.end(), {learned, undetermined});
  return out;
}

Section checks_section(const Json& tree) {
  Table t{{left("flight"), left("action"), left("stream"), {"from, s"}, {"to, s"}, left("what")}};
  for (const Json& c : tree.at("checks")) {
    for (const Json& f : c.at("findings"))
      t.rows.push_back({{text_of(c.at("flight")), text_of(f.at("action")), text_of(f.at("stream")), num(f, "from_s", "{:.2f}"),
                         num(f, "to_s", "{:.2f}"), text_of(f.at("what"))}});
  }
  return {"Findings of the checks", "checks", t.rows.empty() ? std::vector<render::Block>{} : std::vector<render::Block>{t}};
}

}  // namespace

std::string p_text(double p) { return p < 1e-300 ? "< 1e−300" : figure_text(p, "{:.2g}"); }

render::Sections identify_sections(const Json& tree, const Identification& result, const IdentifyAnalysis& analysis) {
  render::List warnings{.items = {}, .kind = "warn"};
  for (const Json& w : tree.at("warnings")) warnings.items.push_back(text_of(w.at("where")) + ": " + text_of(w.at("what")));
  render::Sections out{{"", "", {warnings}}, parameters_section(tree), derived_section(tree)};
  add_comparisons(tree, out);
  if (!tree.at("stages").empty()) out.push_back(stages_section(tree));
  if (tree.contains("held_out")) {
    for (Section& s : held_out_sections(tree.at("held_out"))) out.push_back(std::move(s));
  }
  out.push_back(noise_section(tree));
  add_residuals(tree, result, analysis, out);
  if (value_of(tree.at("homogeneity").at("degrees")) > 0.0) out.push_back(homogeneity_section(tree.at("homogeneity")));
  out.push_back(observability_section(tree, result));
  if (Section checks = checks_section(tree); !checks.blocks.empty()) out.push_back(std::move(checks));
  return out;
}

}  // namespace rotorloop::identify
