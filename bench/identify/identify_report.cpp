#include "bench/identify/identify_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/identify/diagnostics_text.hpp"
#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/identify_text.hpp"
#include "bench/identify/report_figures.hpp"
#include "bench/report/page.hpp"
#include "bench/report/svg_plot.hpp"

namespace rotorloop::bench {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string num(double v, const char* format = "{:.4g}") {
  if (!std::isfinite(v)) return "–";
  std::string text = fmt::format(fmt::runtime(format), v);
  for (std::size_t at = text.find('-'); at != std::string::npos; at = text.find('-', at + 3)) text.replace(at, 1, "−");
  return text;
}
std::string two(double v) { return num(v, "{:.2g}"); }
std::string cell(const std::string& text, const char* kind = "") { return fmt::format("<td{}>{}</td>", kind, text); }

std::string head(const std::vector<std::string>& names) {
  std::string out = "<div class=\"scroll\"><table><thead><tr>";
  for (std::size_t i = 0; i < names.size(); ++i) out += fmt::format("<th{}>{}</th>", i == 0 ? " class=\"l\"" : "", xml_escaped(names[i]));
  return out + "</tr></thead><tbody>\n";
}
constexpr const char* kTableEnd = "</tbody></table></div>\n";

std::string parameters_html(const IdentifyPage& p) {
  const Identification& r = p.result;
  std::string out = head({"parameter", "estimate", "u", "u classical", "u robust", "unit", "file said", "u", "z", ""});
  for (const Estimate& e : r.fit.estimates) {
    const ParameterInfo info = parameter_info(e.parameter, r.problem.start.terms);
    const double before_u = believed_u(p.before, e.parameter, r.problem.start.terms), was = r.start.file[e.parameter];
    const double z = before_u > 0.0 && e.prior_share <= 0.5 ? (e.value - was) / std::hypot(before_u, reported_u(e)) : kNone;
    const std::string mark = mark_of(e);
    out += "<tr>" + cell(xml_escaped(estimate_name(e, r.problem)), " class=\"l\"") + cell(num(e.value, "{:.5g}"), " class=\"big\"") +
           cell("± " + two(reported_u(e))) + cell(two(e.u)) + cell(two(e.u_robust)) + cell(xml_escaped(info.unit), " class=\"l\"") +
           cell(num(was)) + cell(before_u > 0.0 ? "± " + two(before_u) : "") +
           cell(num(z, "{:.1f}"), std::fabs(z) > 2.0 ? " class=\"fail\"" : "") +
           cell(xml_escaped(mark), mark == "model error" ? " class=\"l fail\"" : " class=\"l\"") + "</tr>\n";
  }
  out += kTableEnd;
  out += "<h3>What follows from them</h3>\n" + head({"quantity", "value", "u", "u classical", "u robust", "unit", "meaning"});
  for (const DerivedQuantity& d : p.analysis.derived) {
    out += "<tr>" + cell(xml_escaped(d.symbol), " class=\"l\"") + cell(num(d.value, "{:.5g}"), " class=\"big\"") +
           cell("± " + two(std::max(d.u, d.u_robust))) + cell(two(d.u)) + cell(two(d.u_robust)) +
           cell(xml_escaped(d.unit), " class=\"l\"") + cell(xml_escaped(d.meaning), " class=\"l\"") + "</tr>\n";
  }
  return out + kTableEnd;
}

std::string stages_html(const IdentifyPage& p) {
  const Identification& r = p.result;
  if (r.comparison.empty()) return "";
  std::string out =
      "<h2 id=\"stages\">Stages beside the joint fit</h2>\n<p>Each stage frees its own parameters on its own flight; what it holds counts "
      "with "
      "its uncertainty. z is the difference in uncertainties of the stage.</p>\n";
  out += head({"stage", "parameter", "stage", "u", "held exact", "joint fit", "u", "z", ""});
  std::string last;
  for (const StageComparison& c : r.comparison) {
    double alone = kNone;
    for (const StageResult& s : r.stages) {
      for (std::size_t i = 0; i < s.estimates.size(); ++i) {
        if (s.role == c.role && s.estimates[i].parameter == c.parameter) alone = s.u_alone[i];
      }
    }
    const std::string stage(name(c.role));
    out += fmt::format("<tr{}>", stage != last ? " class=\"first\"" : "") + cell(stage != last ? stage : "", " class=\"l\"") +
           cell(xml_escaped(parameter_info(c.parameter, r.problem.start.terms).symbol), " class=\"l\"") + cell(num(c.stage, "{:.5g}")) +
           cell("± " + two(c.u_stage)) + cell(two(alone)) + cell(num(c.joint, "{:.5g}"), " class=\"big\"") + cell("± " + two(c.u_joint)) +
           cell(num(c.z, "{:.1f}"), c.agrees ? "" : " class=\"fail\"") + cell(c.agrees ? "" : "apart", " class=\"l fail\"") + "</tr>\n";
    last = stage;
  }
  return out + kTableEnd;
}

std::string residuals_html(const IdentifyPage& p) {
  if (p.analysis.whiteness.empty()) return "";
  std::string out =
      "<h2 id=\"residuals\">What the residuals say</h2>\n<p>Innovations: each pose minus its prediction from the past, in units of its "
      "predicted "
      "standard deviation. Under the model they are white and of unit size. A flight outside the band at short lags has noise that is "
      "not white; one outside at long lags moves in a way that the model lacks.</p>\n";
  for (const FlightWhiteness& w : p.analysis.whiteness) {
    out += fmt::format("<h3>{}: {}</h3>\n", xml_escaped(w.flight), w.white() ? "white" : "not white");
    out += head({"channel", "rms", "Ljung–Box 0.1 s, p", "0.5 s", "2 s", "runs, p", ""});
    for (const ChannelWhiteness& c : w.channels) {
      out += "<tr>" + cell(c.channel, " class=\"l\"") + cell(num(c.rms, "{:.3f}"));
      for (const PortmanteauTest& t : c.ljung_box) out += cell(two(t.p));
      out += cell(two(c.runs.p)) + cell(c.white ? "" : "not white", " class=\"l fail\"") + "</tr>\n";
    }
    out += kTableEnd;
    out += "<div class=\"two\">" + autocorrelation_figure(w) + cost_figure(w) + "</div>\n";
  }
  for (std::size_t f = 0; f < p.result.flights.size(); ++f) {
    if (!p.result.fit.reduced[f].innovations.empty())
      out += innovation_figure(p.result.flights[f].name, p.result.fit.reduced[f].innovations);
  }
  return out;
}

std::string homogeneity_html(const IdentifyPage& p) {
  const Homogeneity& h = p.analysis.homogeneity;
  if (h.degrees <= 0.0) return "";
  std::string out = fmt::format(
      "<h2 id=\"flights\">Do the flights tell one vehicle?</h2>\n<p>χ² {} on {:.0f} degrees of freedom, p {}{}. Below: each flight's own "
      "estimate of "
      "each shared parameter, all others free; a dash where the flight cannot tell.</p>\n",
      num(h.chi2, "{:.1f}"), h.degrees, two(h.p),
      p.analysis.inflation > 1.05
          ? fmt::format(" (variances {} × the classical ones, for correlated residuals)", num(p.analysis.inflation, "{:.1f}"))
          : std::string());
  std::vector<std::string> names{"parameter"};
  for (const GridFlight& g : p.result.flights) names.push_back(g.name);
  names.insert(names.end(), {"p", ""});
  out += head(names);
  for (const ParameterHomogeneity& q : h.parameters) {
    out += "<tr>" + cell(xml_escaped(parameter_info(q.parameter, p.result.problem.start.terms).symbol), " class=\"l\"");
    for (std::size_t f = 0; f < q.value.size(); ++f) out += cell(std::isfinite(q.u[f]) ? num(q.value[f]) + " ± " + two(q.u[f]) : "–");
    out += cell(q.degrees > 0.0 ? two(q.p) : "–") + cell(q.moved ? "moved" : "", " class=\"l fail\"") + "</tr>\n";
  }
  return out + kTableEnd;
}

std::string observability_html(const IdentifyPage& p) {
  const Observability& o = p.analysis.observability;
  std::string out = "<h2 id=\"observability\">What these flights can and cannot tell</h2>\n";
  out += fmt::format("<p>Condition of the information, scaled to unit diagonal: {}. Weakest directions:</p>\n", two(o.condition));
  out += head({"information", "direction"});
  for (const OpenDirection& d : o.weakest)
    out += "<tr>" + cell(two(d.information)) + cell(xml_escaped(direction_text(d)), " class=\"l\"") + "</tr>\n";
  out += kTableEnd;
  out +=
      figure_html("<b>Correlations</b> between the estimates; a pair above 0.9 is known as a combination only.", correlation_map(p.result));
  if (!o.advice.empty()) {
    out += head({"parameter", "how it stands", "what would tell it"});
    for (const Advice& a : o.advice)
      out += "<tr>" + cell(xml_escaped(a.parameter), " class=\"l\"") + cell(xml_escaped(a.why), " class=\"l\"") +
             cell(xml_escaped(a.manoeuvre), " class=\"l\"") + "</tr>\n";
    out += kTableEnd;
  }
  // Information per second, each parameter's largest set to 1: where each is learned.
  const host::TermList& terms = p.result.problem.start.terms;
  std::vector<std::string> names{"information per second, share of the best flight"};
  for (const FlightContribution& f : o.flights) names.push_back(f.flight);
  out += head(names);
  for (std::size_t i = 0; i < p.result.problem.free.size(); ++i) {
    double best = 0.0;
    for (const FlightContribution& f : o.flights) best = std::max(best, f.information[i] / std::max(f.seconds, 1e-9));
    out += "<tr>" + cell(xml_escaped(parameter_info(p.result.problem.free[i].parameter, terms).symbol), " class=\"l\"");
    for (const FlightContribution& f : o.flights)
      out += cell(best > 0.0 ? num(f.information[i] / std::max(f.seconds, 1e-9) / best, "{:.3f}") : "–");
    out += "</tr>\n";
  }
  out += kTableEnd;
  for (const FlightContribution& f : o.flights) {
    if (!f.cannot_tell.empty() && o.flights.size() > 1)
      out += fmt::format("<p>{} alone ({:.0f} s) cannot tell {}.</p>\n", xml_escaped(f.flight), f.seconds,
                         xml_escaped(fmt::format("{}", fmt::join(f.cannot_tell, ", "))));
  }
  return out;
}

std::string checks_html(const IdentifyPage& p) {
  std::string rows;
  for (const CheckedFlight& c : p.checked) {
    for (const LogFinding& f : c.findings) {
      const char* action = f.action == FindingAction::note ? "note" : f.action == FindingAction::exclude ? "left out" : "refused";
      rows += "<tr>" + cell(xml_escaped(c.flight.name), " class=\"l\"") + cell(action, " class=\"l\"") +
              cell(xml_escaped(f.stream), " class=\"l\"") + cell(num(f.from_s, "{:.2f}")) + cell(num(f.to_s, "{:.2f}")) +
              cell(xml_escaped(f.what), " class=\"l\"") + "</tr>\n";
    }
  }
  if (rows.empty()) return "";
  return "<h2 id=\"checks\">Findings of the checks</h2>\n" + head({"flight", "action", "stream", "from, s", "to, s", "what"}) + rows +
         kTableEnd;
}

std::string trail_html(const std::vector<TrailPoint>& trail) {
  if (trail.size() < 2) return "";
  std::string out =
      "<h2 id=\"trail\">Trail over trials</h2>\n<p>Each estimate with ± 2 u, in the order of the trials.</p>\n<div class=\"two\">\n";
  for (std::size_t i = 0; i < trail.back().names.size(); ++i) out += trail_figure(trail, trail.back().names[i], trail.back().units[i]);
  return out + "</div>\n";
}

}  // namespace

std::string identify_report_html(const IdentifyPage& p) {
  const Fit& fit = p.result.fit;
  std::string out = page_begin(p.vehicle_name, p.subtitle, "identification");
  auto facts = p.facts;
  facts.emplace_back("flights", fmt::format("{}", p.result.flights.size()));
  facts.emplace_back("cost / degree of freedom", num(2.0 * fit.cost / fit.degrees_of_freedom, "{:.3f}"));
  facts.emplace_back("iterations", fmt::format("{}{}", fit.iterations, fit.converged ? "" : ", not converged"));
  out += facts_html(facts);
  if (!fit.converged)
    out += "<div class=\"warn\"><ul><li>The fit did not converge: the figures below are where it stopped.</li></ul></div>\n";
  out +=
      "<h2 id=\"parameters\">Parameters</h2>\n<p>u is the larger of the classical uncertainty and the one that holds for correlated "
      "residuals; "
      "“model error” marks a parameter whose robust uncertainty is 5 times the classical one or more: the model lacks something that it "
      "stands in for. z compares with what the vehicle file said before.</p>\n";
  out += parameters_html(p) + stages_html(p) + p.held_out_html + residuals_html(p) + homogeneity_html(p) + observability_html(p) +
         checks_html(p) + trail_html(p.trail);
  return out + page_end();
}

std::string trail_page_html(const std::vector<TrailPoint>& trail) {
  return page_begin("Identification over trials", fmt::format("{} results", trail.size()), "trail") + trail_html(trail) + page_end();
}

}  // namespace rotorloop::bench
