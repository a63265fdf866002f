#include "bench/sysid/identify/report/identify_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "bench/render/page.hpp"
#include "bench/sysid/identify/report/identify_sections.hpp"
#include "bench/sysid/identify/report/identify_text.hpp"
#include "bench/sysid/identify/report/parameter_history.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::identify {
namespace {

using Json = nlohmann::ordered_json;
using render::figure_text;

std::string listed(const Json& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names.get<std::vector<std::string>>(), ", "));
}

// How the fit was asked for, and how it ended.
std::vector<std::pair<std::string, std::string>> facts_of(const Json& tree) {
  const Json& c = tree.at("conditions");
  Json held = Json::array();
  for (const Json& h : tree.at("held")) held.push_back(h.at("label"));
  std::vector<std::pair<std::string, std::string>> out{{"rotorloop", text_of(tree.at("version"))},
                                                       {"git", text_of(tree.at("git"))},
                                                       {"start", text_of(c.at("vehicle_file"))},
                                                       {"added terms", listed(c.at("terms"))},
                                                       {"held", listed(held)}};
  if (!c.at("per_flight").empty()) out.emplace_back("per flight", listed(c.at("per_flight")));
  if (!c.at("free").empty()) out.emplace_back("freed", listed(c.at("free")));
  out.emplace_back("measurements", c.at("use").empty() ? "poses" : "poses, " + listed(c.at("use")));
  out.emplace_back("noise", text_of(c.at("noise")));
  const double rate_Hz = value_of(c.at("rate_Hz"));
  out.emplace_back("rate", rate_Hz > 0.0 ? figure_text(rate_Hz) + " Hz" : "as poses");
  out.emplace_back("solver", text_of(c.at("solver")));
  const auto bound = [](const Json& s, const char* none) { return s.is_null() ? std::string(none) : figure_text(value_of(s)) + " s"; };
  const Json &from = c.at("from_s"), &to = c.at("to_s");
  out.emplace_back("window", from.is_null() && to.is_null() ? "whole flights" : bound(from, "start") + " to " + bound(to, "end"));
  const Json& fit = tree.at("fit");
  const bool converged = fit.at("converged");
  out.emplace_back("cost / degree of freedom",
                   figure_text(value_of(tree.at("figures").at("cost_per_degree_of_freedom").at("value")), "{:.3f}"));
  out.emplace_back("iterations", fmt::format("{}{}", fit.at("iterations").get<int>(), converged ? "" : ", not converged"));
  return out;
}

// Flights that were named and had no part in the fit.
std::vector<std::string> left_out(const std::vector<log::CheckedFlight>& checked) {
  std::vector<std::string> out;
  for (const log::CheckedFlight& c : checked) {
    if (c.refusal) out.push_back(fmt::format("{} (refused by the checks: {})", c.flight.name, c.refusal->what));
  }
  return out;
}

Json tree_of(const IdentifyPage& p) { return identify_tree(p.result, p.analysis, p.comparison, p.checked, p.provenance); }

}  // namespace

std::vector<HistoryReference> history_references(const FileComparison& c, const std::vector<DerivedQuantity>& derived,
                                                 const host::TermList& terms) {
  std::vector<HistoryReference> out;
  for (const ComparisonColumn& b : c.others) {
    HistoryReference r{.label = b.label, .value = {}, .q_BS = b.q_BS};
    for (std::size_t i = 0; i < c.rows.size(); ++i) {
      if (b.parameters[i]) r.value[estimate::parameter_info(c.rows[i].parameter, terms).symbol] = b.parameters[i]->value;
    }
    for (std::size_t i = 0; i < b.derived.size(); ++i) r.value[derived[i].symbol] = b.derived[i].value;
    out.push_back(std::move(r));
  }
  return out;
}

std::string identify_text(const IdentifyPage& p) {
  const Json tree = tree_of(p);
  const Json& fit = tree.at("fit");
  const bool converged = fit.at("converged"), settled = fit.at("noise_settled");
  std::string out = render::terminal_text(identify_sections(tree, p.result, p.analysis));
  out += fmt::format("\n{} flights, {} iterations, {} rounds of noise{}; cost/dof {:.4f}\n", fit.at("flights").get<std::size_t>(),
                     fit.at("iterations").get<int>(), fit.at("noise_rounds").get<int>(),
                     !converged ? " (NOT CONVERGED)"
                     : settled  ? ""
                                : " (noise not settled)",
                     value_of(tree.at("figures").at("cost_per_degree_of_freedom").at("value")));
  for (const std::string& flight : left_out(p.checked)) out += "left out: " + flight + "\n";
  return out + (p.analysis.solver_check ? solver_check_text(*p.analysis.solver_check) : "");
}

std::string identify_report_html(const IdentifyPage& p) {
  const Json tree = tree_of(p);
  std::vector<std::string> flights;
  for (const estimate::GridFlight& g : p.result.flights) flights.push_back(g.name);
  auto facts = facts_of(tree);
  for (const std::string& flight : left_out(p.checked)) facts.emplace_back("left out", flight);
  if (p.analysis.solver_check) facts.emplace_back("check by another solver", solver_check_text(*p.analysis.solver_check));
  return render::page_begin(fmt::format("Vehicle identified from {} flight{}", flights.size(), flights.size() == 1 ? "" : "s"),
                            fmt::format("identified from {}; start: {} ({})", fmt::join(flights, ", "), p.start_name,
                                        p.provenance.conditions.vehicle.filename().generic_string()),
                            "identification") +
         render::banner_html(identify_outcome(p.result, p.analysis, p.provenance)) + render::facts_html(facts) +
         render::page_html(identify_sections(tree, p.result, p.analysis)) + history_html(p.history, p.references) + render::page_end();
}

}  // namespace rotorloop::identify
