#include "bench/hil/closed_loop/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/hil/closed_loop/report_evidence.hpp"
#include "bench/hil/closed_loop/run_layout.hpp"
#include "bench/render/digits.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "bench/sysid/log/log_reader.hpp"
#include "host/base/error.hpp"
#include "host/base/toml_file.hpp"

namespace rotorloop::closed_loop {
namespace fs = std::filesystem;
namespace {

// One thing, one colour, in every plot of the page.
constexpr int kBefore = 0, kIdentified = 1, kAfter = 2;
constexpr const char* kBeforeName = "nominal model";
constexpr const char* kIdentifiedName = "identified, no effect added";
constexpr const char* kAfterName = "with what the diagnosis added";

std::string axis_label(hil::ErrorAxis a) { return a == hil::ErrorAxis::z ? "|z|" : "3-D"; }

std::string added_text(const Findings& f) {
  std::string out;
  for (const auto& e : f.added) {
    out += (out.empty() ? "" : "; ") + e.id;
    for (const auto& p : e.parameters)
      out += fmt::format(", {} = {}{}", p.name, render::measured_text(p.value, p.u), p.unit == "1" ? "" : " " + p.unit);
    if (!e.aliases.empty()) out += fmt::format(" (or {})", alias_names(e));
  }
  return out.empty() ? "nothing added" : out;
}

std::string head(const LoopResult& r) {
  std::string out = render::page_begin(r.plan.name, "closed-loop study: flown, diagnosed, flown again", "rotorloop close");
  render::Outcome outcome = loop_outcome(r);
  outcome.sentence += " " + added_text(r.findings) + ".";
  out += render::banner_html(outcome);
  out += render::facts_html(
      {{"sandboxed by", r.isolation.layers + (r.isolation.enforced_by.empty() ? "" : " (" + r.isolation.enforced_by + ")")},
       {"ways to the truth tried", fmt::format("{}, {} opened", r.isolation.attempts, r.isolation.opened.size())},
       {"learnt from", fmt::format("{} flights", r.plan.learn.size() * r.plan.learn_seeds.size())},
       {"held out", fmt::format("{} flights", r.plan.held_out.size() * r.plan.held_out_seeds.size())},
       {"judged", fmt::format("{} flights × {} seeds", r.plan.judged.size(), r.plan.judged_seeds.size())},
       {"controller", std::string(hil::variant_label(r.plan.variant))}});
  std::vector<std::string> warnings;
  if (!r.isolation.holds)
    warnings.push_back(
        "Not isolated: no sandbox holds on this machine, and the diagnosis could have read the plant. Nothing shows that it did; nothing "
        "kept it from it. `rotorloop close --help` says what a machine needs.");
  if (r.after_is_before) warnings.push_back("Nothing was flown again, after is before: " + r.why_not_flown + ".");
  if (!r.identified) warnings.push_back("Identification without effects gave no vehicle file that can be flown; its column is empty.");
  for (const auto& f : r.findings.faults) warnings.push_back("Fault found in the logs: " + f);
  if (!warnings.empty()) {
    out += "<ul class=\"warn\">";
    for (const auto& w : warnings) out += "<li>" + render::xml_escaped(w) + "</li>";
    out += "</ul>\n";
  }
  return out;
}

std::string spread_cell(const std::vector<double>& v) {
  const hil::Spread s = hil::spread_of(v);
  return s.n == 0 ? "–" : fmt::format("{:.2f} ± {:.2f}", s.mean, s.std);
}

std::string tracking_section(const LoopResult& r) {
  render::BarChart chart;
  chart.title = "tracking error of each judged flight, before and after";
  chart.x_label = "mean tracking error, cm";
  const auto bar = [&](const TrackedFlight& t, const char* which, const std::vector<double>& v, int colour) {
    const hil::Spread s = hil::spread_of(v);
    if (s.n == 0) return;
    chart.bars.push_back({fmt::format("{} ({}), {}", t.plan.flight.name, axis_label(t.plan.axis), which), s.mean, s.std, v, {}, colour});
  };
  std::string rows;
  for (const auto& t : r.tracking) {
    bar(t, "before", t.before, kBefore);
    bar(t, "identified", t.identified, kIdentified);
    bar(t, "after", t.after, kAfter);
    rows += fmt::format(
        "<tr><td class=\"l\">{} ({})</td><td>{}</td><td>{}</td><td class=\"big\">{}</td><td>{}</td><td class=\"l {}\">{}</td></tr>\n",
        render::xml_escaped(t.plan.flight.name), axis_label(t.plan.axis), spread_cell(t.before), spread_cell(t.identified),
        spread_cell(t.after), t.plan.expect == Expectation::better ? "better" : "no worse", t.pass ? "pass" : "fail",
        render::xml_escaped(t.reason));
  }
  return "<h2>Tracking before and after</h2>\n<p>The same flights with the same seeds, flown with three vehicle files: the one at the "
         "start, one with "
         "its parameters identified from the flights to learn from, one with what the diagnosis added. Distance of the true centre of mass "
         "from the "
         "set-point, mean from first to last motion, then over seeds; dots are seeds, whiskers standard deviations.</p>\n" +
         render::figure_html("", render::bar_chart_svg(chart)) +
         "<div class=\"scroll\"><table><tr><th class=\"l\">flight</th><th>before, cm</th><th>identified, cm</th><th>after, "
         "cm</th><th>expected</th>"
         "<th class=\"l\">after against before: paired by seed, bootstrap</th></tr>\n" +
         rows + "</table></div>\n";
}

// Error of one flight over time; empty when its logs are gone.
render::Series error_series(const fs::path& folder, const char* label, int colour, hil::ErrorAxis axis) {
  render::Series s;
  if (!fs::is_regular_file(folder / "truth.csv") || !fs::is_regular_file(folder / "flight.csv")) return s;
  const log::LogTable truth = log::read_log(folder / "truth.csv", {"t[s]", "true_p_x[m]", "true_p_y[m]", "true_p_z[m]"});
  const log::LogTable flight = log::read_log(folder / "flight.csv", {"sp_p_x[m]", "sp_p_y[m]", "sp_p_z[m]"});
  s.label = label;
  s.colour = colour;
  s.x = truth.column("t[s]");
  for (std::size_t i = 0; i < std::min(truth.rows, flight.rows); ++i) {
    const double x = truth.column("true_p_x[m]")[i] - flight.column("sp_p_x[m]")[i];
    const double y = truth.column("true_p_y[m]")[i] - flight.column("sp_p_y[m]")[i];
    const double z = truth.column("true_p_z[m]")[i] - flight.column("sp_p_z[m]")[i];
    s.y.push_back(100.0 * (axis == hil::ErrorAxis::z ? z : std::hypot(x, y, z)));
  }
  s.x.resize(s.y.size());
  return s;
}

std::string time_section(const LoopResult& r) {
  const LoopLayout at{r.run};
  std::string out;
  for (const auto& t : r.tracking) {
    if (t.seeds.empty()) continue;
    const fs::path below = fs::path("judged") / t.plan.flight.name / hil::variant_name(r.plan.variant) / std::to_string(t.seeds.front());
    render::Plot plot;
    plot.title = "tracking error over time, " + t.plan.flight.name;
    plot.x_label = "time, s";
    plot.y_label = t.plan.axis == hil::ErrorAxis::z ? "z error, cm" : "3-D error, cm";
    plot.y_from_zero = t.plan.axis == hil::ErrorAxis::norm_3d;
    for (auto& s : {error_series(at.before() / below, kBeforeName, kBefore, t.plan.axis),
                    r.identified ? error_series(at.identified() / below, kIdentifiedName, kIdentified, t.plan.axis) : render::Series{},
                    r.after_is_before ? render::Series{} : error_series(at.after() / below, kAfterName, kAfter, t.plan.axis)})
      if (!s.y.empty()) plot.series.push_back(s);
    if (plot.series.empty()) continue;
    // The start from the stand shows the same in all; what counts begins with the motion.
    const hil::RunResult before = hil::read_result(at.before() / "judged");
    for (const auto& f : before.flights)
      if (f.flight == t.plan.flight.name && f.seed == t.seeds.front() && std::isfinite(f.tracking.first_motion_s)) {
        plot.fit_from = f.tracking.first_motion_s;
        plot.fit_to = f.tracking.last_motion_s;
        plot.bands.push_back({f.tracking.first_motion_s, f.tracking.last_motion_s, "counts", render::kNeutral});
      }
    out +=
        render::figure_html(fmt::format("{}, seed {}", render::xml_escaped(t.plan.flight.name), t.seeds.front()), render::plot_svg(plot));
  }
  return out.empty() ? "" : "<h3>Over time</h3>\n" + out;
}

std::string isolation_section(const LoopResult& r) {
  std::string out = "<h2>What the diagnosis could know</h2>\n<p>";
  out += fmt::format("It had {} logs (flight.csv) and the vehicle file in a folder of its own. ",
                     r.plan.learn.size() * r.plan.learn_seeds.size() + r.plan.held_out.size() * r.plan.held_out_seeds.size());
  if (r.isolation.holds) {
    std::string ways;
    for (const auto& w : r.isolation.ways) ways += (ways.empty() ? "" : ", ") + w;
    out += fmt::format(
        "Its process was sandboxed by {}{}. Before it started, a program in the same sandbox tried {} times to reach the plan, the "
        "plant and truth.csv – by {} – and opened nothing.",
        render::xml_escaped(r.isolation.layers),
        r.isolation.enforced_by.empty() ? "" : " (" + render::xml_escaped(r.isolation.enforced_by) + ")", r.isolation.attempts,
        render::xml_escaped(ways));
  } else {
    out += "<b>It was not isolated</b>: ";
    for (const auto& g : r.isolation.gave_up) out += render::xml_escaped(g) + "; ";
    out += "what was open: ";
    for (const auto& o : r.isolation.opened) out += render::xml_escaped(o) + "; ";
  }
  return out + "</p>\n";
}

std::string truth_section(const LoopResult& r) {
  if (!r.truth_compared) return "";
  std::string out =
      "<h2>Afterwards: the truth</h2>\n<div class=\"scroll\"><table><tr><th class=\"l\">hidden</th><th class=\"l\">name</th><th "
      "class=\"l\">as</th><th class=\"l\">size</th></tr>\n";
  for (const auto& h : r.truth.hidden) {
    const char* name = h.name == NameResult::right ? "right" : h.name == NameResult::in_class ? "in a class" : "missed";
    const char* size = h.size == Size::right ? "right" : h.size == Size::wrong ? "wrong" : "not compared";
    out += fmt::format("<tr><td class=\"l\">{}</td><td class=\"l {}\">{}</td><td class=\"l\">{}</td><td class=\"l {}\">{}</td></tr>\n",
                       render::xml_escaped(h.id), h.name == NameResult::missed ? "fail" : "pass", name, render::xml_escaped(h.answer),
                       h.size == Size::wrong ? "fail" : "", size);
  }
  for (const auto& w : r.truth.wrong)
    out += fmt::format("<tr><td class=\"l\">–</td><td class=\"l fail\">wrong</td><td class=\"l\">{}</td><td></td></tr>\n",
                       render::xml_escaped(w));
  if (r.truth.hidden.empty() && r.truth.wrong.empty())
    out += "<tr><td class=\"l\" colspan=\"4\">nothing was hidden, and nothing was found</td></tr>\n";
  out +=
      "</table><table><tr><th class=\"l\">quantity</th><th>truth</th><th>found</th><th>u</th><th>error / u</th><th "
      "class=\"l\">size</th></tr>\n";
  for (const auto& v : r.truth.values)
    out += fmt::format(
        "<tr><td class=\"l\">{}, {}</td><td>{:.5g}</td><td>{:.5g}</td><td>{:.2g}</td><td>{}</td><td class=\"l {}\">{}</td></tr>\n",
        render::xml_escaped(v.what), render::xml_escaped(v.unit), v.truth, v.found, v.u,
        v.u > 0 ? fmt::format("{:.1f}", v.errors_in_u()) : "–", v.right() ? "pass" : "fail", v.right() ? "right" : "wrong");
  return out + "</table></div>\n";
}

fs::path diagnosis_page(const LoopResult& r) { return LoopLayout{r.run}.diagnosis().parent_path() / "report.html"; }

std::string provenance_section(const LoopResult& r) {
  const auto file = TomlFile::read(LoopLayout{r.run}.run_toml());
  const auto root = file.root();
  std::string out = "<h2>Provenance</h2>\n" + render::facts_html({{"made by", r.version}}) + "<pre>" +
                    render::xml_escaped(root.text("repeat", "")) +
                    "</pre>\n<div class=\"scroll\"><table><tr><th class=\"l\">input</th><th class=\"l\">SHA-256</th></tr>\n";
  for (const auto& t : root.tables("input", 0, 10'000))
    out += fmt::format("<tr><td class=\"l\">{}</td><td class=\"l hash\">{}</td></tr>\n", render::xml_escaped(t.text("path")),
                       t.text("sha256").substr(0, 16));
  return out + "</table></div>\n";
}

}  // namespace

std::string loop_report_html(const LoopResult& r) {
  return head(r) + tracking_section(r) + time_section(r) + evidence_section(r.findings) + added_section(r.findings) +
         held_out_section(r.findings) + residual_section(diagnosis_page(r), diagnosis_page(r).lexically_relative(r.run).generic_string()) +
         truth_section(r) + isolation_section(r) + provenance_section(r) + render::page_end();
}

}  // namespace rotorloop::closed_loop
