#include "bench/identify/report/identify_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bench/identify/report/diagnostics_text.hpp"
#include "bench/identify/report/report_cells.hpp"
#include "bench/identify/report/report_figures.hpp"
#include "bench/identify/report/report_tables.hpp"
#include "bench/identify/report/trail.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string p_cell(double p) { return cell(render::xml_escaped(p_text(p))); }

std::string stages_html(const IdentifyPage& p) {
  const Identification& r = p.result;
  if (r.comparison.empty()) return "";
  std::string out =
      "<h2 id=\"stages\">Stages beside the joint fit</h2>\n<p>Each stage frees its own parameters on its own flight; what it holds counts "
      "with "
      "its uncertainty. z is the difference in uncertainties of the stage.</p>\n";
  out += head({left("stage"), left("parameter"), "stage", "u", "held exact", "joint fit", "u", "z", left("")});
  std::string last;
  for (const StageComparison& c : r.comparison) {
    double alone = kNone;
    for (const StageResult& s : r.stages) {
      for (std::size_t i = 0; i < s.estimates.size(); ++i) {
        if (s.role == c.role && s.estimates[i].parameter == c.parameter) alone = s.u_alone[i];
      }
    }
    const std::string stage(name(c.role));
    out += fmt::format("<tr{}>", stage != last ? " class=\"first\"" : "") + cell(stage != last ? stage : "", "l") +
           left_cell(estimate::parameter_info(c.parameter, r.problem.start.terms).symbol) + cell(num(c.stage, "{:.5g}")) +
           cell("± " + two(c.u_stage)) + cell(two(alone)) + cell(num(c.joint, "{:.5g}"), "big") + cell("± " + two(c.u_joint)) +
           cell(num(c.z, "{:.1f}"), c.agrees ? "" : "fail") + cell(c.agrees ? "" : "apart", "l fail") + "</tr>\n";
    last = stage;
  }
  return out + kTableEnd;
}

std::string residuals_html(const IdentifyPage& p) {
  std::string out = "<h2 id=\"residuals\">What the residuals say</h2>\n";
  if (p.analysis.whiteness.empty())
    return out +
           "<p>Nothing: none of these flights has poses of position and attitude, and it is their innovations that are judged. A log with "
           "a "
           "pose stream fills this section.</p>\n";
  out +=
      "<p>Innovations: each pose minus its prediction from the past, in units of its predicted standard deviation. Under the model they "
      "are "
      "white and of unit size. The six channels are whitened in order, x, y, z, roll, pitch, yaw: each holds what those before it leave, "
      "so "
      "what disturbs several shows most in the first of them. A flight outside the band at short lags has noise that is not white; one "
      "outside at long lags moves in a way that the model lacks.</p>\n";
  for (const FlightWhiteness& w : p.analysis.whiteness) {
    out += fmt::format("<h3>{}: {}</h3>\n", render::xml_escaped(w.flight), w.white() ? "white" : "not white");
    out += head({left("channel"), "rms", "Ljung–Box 0.1 s, p", "0.5 s", "2 s", "runs, p", left("")});
    for (const ChannelWhiteness& c : w.channels) {
      out += "<tr>" + cell(c.channel, "l") + cell(num(c.rms, "{:.3f}"));
      for (const PortmanteauTest& t : c.ljung_box) out += p_cell(t.p);
      out += p_cell(c.runs.p) + cell(c.white ? "" : "not white", "l fail") + "</tr>\n";
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
      num(h.chi2, "{:.1f}"), h.degrees, render::xml_escaped(h.p < 1e-300 ? p_text(h.p) : "= " + p_text(h.p)),
      p.analysis.inflation > 1.05
          ? fmt::format(" (variances {} × the classical ones, for correlated residuals)", num(p.analysis.inflation, "{:.1f}"))
          : std::string());
  std::vector<HeadCell> names{left("parameter")};
  for (const estimate::GridFlight& g : p.result.flights) names.push_back(g.name);
  names.insert(names.end(), {"p", left("")});
  out += head(names);
  for (const ParameterHomogeneity& q : h.parameters) {
    out += "<tr>" + left_cell(estimate::parameter_info(q.parameter, p.result.problem.start.terms).symbol);
    for (std::size_t f = 0; f < q.value.size(); ++f) out += cell(std::isfinite(q.u[f]) ? num(q.value[f]) + " ± " + two(q.u[f]) : "–");
    out += (q.degrees > 0.0 ? p_cell(q.p) : cell("–")) + cell(q.moved ? "moved" : "", "l fail") + "</tr>\n";
  }
  return out + kTableEnd;
}

std::string observability_html(const IdentifyPage& p) {
  const Observability& o = p.analysis.observability;
  std::string out = "<h2 id=\"observability\">What these flights can and cannot tell</h2>\n";
  out += fmt::format("<p>Condition of the information, scaled to unit diagonal: {}. Weakest directions:</p>\n", two(o.condition));
  out += head({"information", left("direction")});
  for (const estimate::OpenDirection& d : o.weakest)
    out += "<tr>" + cell(two(d.information)) + left_cell(with_true_minus(direction_text(d))) + "</tr>\n";
  out += kTableEnd;
  out +=
      render::figure_html("<b>Correlations</b> between the estimates; a pair above 0.9 is known as a combination only.", correlation_map(p.result));
  if (!o.advice.empty()) {
    out += head({left("parameter"), left("how it stands"), left("what would tell it")});
    for (const Advice& a : o.advice) out += "<tr>" + left_cell(a.parameter) + left_cell(a.why) + left_cell(a.manoeuvre) + "</tr>\n";
    out += kTableEnd;
  }
  // Information per second, each parameter's largest set to 1: where each is learned.
  const host::TermList& terms = p.result.problem.start.terms;
  std::vector<HeadCell> names{left("information per second, share of the best flight")};
  for (const FlightContribution& f : o.flights) names.push_back(f.flight);
  out += head(names);
  for (std::size_t i = 0; i < p.result.problem.free.size(); ++i) {
    double best = 0.0;
    for (const FlightContribution& f : o.flights) best = std::max(best, f.information[i] / std::max(f.seconds, 1e-9));
    out += "<tr>" + left_cell(estimate::parameter_info(p.result.problem.free[i].parameter, terms).symbol);
    for (const FlightContribution& f : o.flights)
      out += cell(best > 0.0 ? num(f.information[i] / std::max(f.seconds, 1e-9) / best, "{:.3f}") : "–");
    out += "</tr>\n";
  }
  out += kTableEnd;
  for (const FlightContribution& f : o.flights) {
    if (!f.cannot_tell.empty() && o.flights.size() > 1)
      out += fmt::format("<p>{} alone ({:.0f} s) cannot tell {}.</p>\n", render::xml_escaped(f.flight), f.seconds,
                         render::xml_escaped(fmt::format("{}", fmt::join(f.cannot_tell, ", "))));
  }
  return out;
}

std::string checks_html(const IdentifyPage& p) {
  std::string rows;
  for (const log::CheckedFlight& c : p.checked) {
    for (const log::LogFinding& f : c.findings) {
      const char* action = f.action == log::FindingAction::note ? "note" : f.action == log::FindingAction::exclude ? "left out" : "refused";
      rows += "<tr>" + left_cell(c.flight.name) + left_cell(action) + left_cell(f.stream) + cell(num(f.from_s, "{:.2f}")) +
              cell(num(f.to_s, "{:.2f}")) + left_cell(f.what) + "</tr>\n";
    }
  }
  if (rows.empty()) return "";
  return "<h2 id=\"checks\">Findings of the checks</h2>\n" +
         head({left("flight"), left("action"), left("stream"), "from, s", "to, s", left("what")}) + rows + kTableEnd;
}

std::string warnings_html(const IdentifyPage& p) {
  const std::vector<IdentifyWarning> warnings = warnings_of(p.result, p.analysis);
  if (warnings.empty()) return "";
  std::string out = "<ul class=\"warn\">";
  for (const IdentifyWarning& w : warnings)
    out += "<li><b>" + render::xml_escaped(w.where) + "</b>: " + render::xml_escaped(with_true_minus(w.what)) + "</li>\n";
  return out + "</ul>\n";
}

}  // namespace

std::vector<TrailReference> trail_references(const FileComparison& c, const std::vector<DerivedQuantity>& derived,
                                             const host::TermList& terms) {
  std::vector<TrailReference> out;
  for (const BesideColumn& b : c.beside) {
    TrailReference r{.label = b.label, .value = {}, .q_BS = b.q_BS};
    for (std::size_t i = 0; i < c.rows.size(); ++i) {
      if (b.parameters[i]) r.value[estimate::parameter_info(c.rows[i].parameter, terms).symbol] = b.parameters[i]->value;
    }
    for (std::size_t i = 0; i < b.derived.size(); ++i) r.value[derived[i].symbol] = b.derived[i].value;
    out.push_back(std::move(r));
  }
  return out;
}

std::string identify_report_html(const IdentifyPage& p) {
  const estimate::Fit& fit = p.result.fit;
  std::vector<std::string> flights;
  for (const estimate::GridFlight& g : p.result.flights) flights.push_back(g.name);
  std::string out = render::page_begin(
      fmt::format("Vehicle identified from {} flight{}", flights.size(), flights.size() == 1 ? "" : "s"),
      fmt::format("identified from {}; start: {} ({})", fmt::join(flights, ", "), p.start_name, p.provenance.conditions.vehicle_file),
      "identification");
  auto facts = conditions_facts(p);
  facts.emplace_back("cost / degree of freedom", num(2.0 * fit.cost / fit.degrees_of_freedom, "{:.3f}"));
  facts.emplace_back("iterations", fmt::format("{}{}", fit.iterations, fit.converged ? "" : ", not converged"));
  if (p.analysis.solver_check) facts.emplace_back("check by another solver", solver_check_text(*p.analysis.solver_check));
  out += render::facts_html(facts) + warnings_html(p);
  out +=
      "<h2 id=\"parameters\">Parameters</h2>\n<p>u is the larger of the classical uncertainty and the one that holds for correlated "
      "residuals; “model error” marks a parameter whose robust uncertainty is 5 times the classical one or more: the model lacks something "
      "that it stands in for. “held” was not estimated. z compares with what the vehicle file said before (a dash: no vehicle file says "
      "that), red beyond 2 where that was no guess.</p>\n";
  out += parameters_html(p) + beside_html(p) + stages_html(p) + p.held_out_html + noise_html(p) + residuals_html(p) + homogeneity_html(p) +
         observability_html(p) + checks_html(p) + trail_html(p.trail, p.references);
  return out + render::page_end();
}

}  // namespace rotorloop::identify
