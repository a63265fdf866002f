#include "bench/identify/identify_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/identify_text.hpp"
#include "host/base/error.hpp"

namespace rotorloop::bench {
namespace {

using nlohmann::ordered_json;

ordered_json number(double v) { return std::isfinite(v) ? ordered_json(v) : ordered_json(nullptr); }

ordered_json figure(double value, double u, const std::string& unit, std::size_t n) {
  return {{"value", number(value)}, {"u", number(u)}, {"unit", unit}, {"n", n}};
}

ordered_json whiteness_json(const FlightWhiteness& w) {
  ordered_json channels = ordered_json::array();
  for (const ChannelWhiteness& c : w.channels) {
    ordered_json tests = ordered_json::array();
    for (const PortmanteauTest& t : c.ljung_box) tests.push_back({{"lags", t.lags}, {"q", number(t.q)}, {"p", number(t.p)}});
    channels.push_back({{"channel", c.channel},
                        {"rms", number(c.rms)},
                        {"white", c.white},
                        {"ljung_box", tests},
                        {"runs", {{"z", number(c.runs.z)}, {"p", number(c.runs.p)}}}});
  }
  return {{"flight", w.flight}, {"white", w.white()}, {"channels", channels}};
}

ordered_json observability_json(const Observability& o) {
  ordered_json weakest = ordered_json::array(), pairs = ordered_json::array(), flights = ordered_json::array(),
               advice = ordered_json::array();
  for (const OpenDirection& d : o.weakest) {
    ordered_json parts = ordered_json::array();
    for (const auto& [name, share] : d.parts) parts.push_back({{"parameter", name}, {"share", share}});
    weakest.push_back({{"information", number(d.information)}, {"parts", parts}});
  }
  for (const CorrelatedPair& c : o.correlated) pairs.push_back({{"first", c.first}, {"second", c.second}, {"correlation", c.correlation}});
  for (const FlightContribution& f : o.flights)
    flights.push_back({{"flight", f.flight}, {"seconds", f.seconds}, {"cannot_tell", f.cannot_tell}});
  for (const Advice& a : o.advice) advice.push_back({{"parameter", a.parameter}, {"why", a.why}, {"manoeuvre", a.manoeuvre}});
  return {{"condition", number(o.condition)}, {"weakest", weakest}, {"correlated", pairs}, {"flights", flights}, {"advice", advice}};
}

ordered_json difference_json(const FitDifference& d) {
  return {{"cost", number(d.cost)},
          {"estimate_u", number(d.estimate_u)},
          {"estimate", d.estimate},
          {"uncertainty", number(d.uncertainty)},
          {"uncertainty_of", d.of}};
}

ordered_json solver_check_json(const SolverCheck& c) {
  ordered_json j = {{"solver", "ceres"}, {"good", c.good()}, {"problem", solver_check_problem(c)}};
  if (!c.failure.empty()) return j;
  j["own_cost"] = number(c.own_cost);
  j["ceres_cost"] = number(c.ceres_cost);
  j["iterations"] = c.iterations;
  j["converged"] = c.converged;
  j["told"] = difference_json(c.told);
  j["to_the_end"] = difference_json(c.to_the_end);
  j["within_acceptance"] = within_acceptance(c.to_the_end);
  return j;
}

}  // namespace

ordered_json input_json(const InputHash& i) {
  ordered_json out{{"path", i.path}, {"sha256", i.sha256}};
  if (i.held_out) out["held_out"] = true;
  return out;
}

IdentifyAnalysis analyse(const Identification& r, const host::VehicleModel& base, double drag_speed_m_s) {
  IdentifyAnalysis a;
  a.derived = derived_quantities(r.fit, base, drag_speed_m_s);
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    if (!r.fit.reduced[f].innovations.empty()) a.whiteness.push_back(whiteness_of(r.flights[f].name, r.fit.reduced[f].innovations));
  }
  std::vector<double> ratio;
  for (const Estimate& e : r.fit.estimates) {
    if (e.prior_share <= 0.5 && e.u > 0.0) ratio.push_back(e.u_robust * e.u_robust / (e.u * e.u));
  }
  if (!ratio.empty()) {
    std::nth_element(ratio.begin(), ratio.begin() + static_cast<std::ptrdiff_t>(ratio.size() / 2), ratio.end());
    a.inflation = std::max(1.0, ratio[ratio.size() / 2]);
  }
  a.homogeneity = homogeneity_of(r.problem, r.fit, a.inflation);
  a.observability = observability_of(r.problem, r.fit);
  return a;
}

// What a reader of the figures must know first: [{"where", "what"}].
static ordered_json warnings_json(const Identification& r, const IdentifyAnalysis& a) {
  ordered_json out = ordered_json::array();
  const auto warn = [&](const std::string& where, const std::string& what) { out.push_back({{"where", where}, {"what", what}}); };
  if (!r.fit.converged) warn("fit", "did not converge: values and uncertainties are those of the last step");
  if (const std::string note = blocks_note(r.fit); !note.empty()) warn("robust u", note);
  if (!r.fit.noise_settled) warn("noise", "the rounds ran out before every noise figure came to rest");
  if (a.solver_check && !a.solver_check->good()) warn("solver", solver_check_problem(*a.solver_check));
  if (r.start.thrust_scale != 1.0)
    warn("start values",
         fmt::format("thrust and torque of the vehicle file were multiplied by {:.3g} to carry the weight", r.start.thrust_scale));
  for (const Estimate& e : r.fit.estimates) {
    if (const std::string mark = mark_of(e); !mark.empty() && mark != "weighed") warn(estimate_name(e, r.problem), mark);
  }
  for (const StageComparison& c : r.comparison) {
    if (!c.agrees)
      warn(fmt::format("stage {}", name(c.role)), fmt::format("{} is {:+.1f} standard uncertainties from the joint fit",
                                                              parameter_info(c.parameter, r.problem.start.terms).symbol, c.z));
  }
  for (const FlightWhiteness& w : a.whiteness) {
    if (!w.white()) warn(w.flight, "innovations are not white: the model lacks something in this flight, or the noise is not white");
  }
  for (const ParameterHomogeneity& h : a.homogeneity.parameters) {
    if (h.moved) warn("between flights", parameter_info(h.parameter, r.problem.start.terms).symbol + " is not the same in all flights");
  }
  return out;
}

std::string identify_result_json(const Identification& r, const IdentifyAnalysis& a, const std::vector<CheckedFlight>& checked,
                                 const IdentifyProvenance& p) {
  ordered_json j = {{"format", 1}, {"command", "identify"}, {"version", p.version}, {"git", p.git}};
  for (const InputHash& i : p.inputs) j["inputs"].push_back(input_json(i));
  j["started_utc"] = p.started_utc;
  j["wall_s"] = p.wall_s;
  j["verdict"] = !r.fit.converged ? "incomplete" : a.solver_check && !a.solver_check->good() ? "fail" : "pass";
  j["limits"] = ordered_json::array();

  std::size_t steps = 0;
  for (const GridFlight& g : r.flights) steps += g.knots;
  ordered_json figures = ordered_json::object(), estimates = ordered_json::array();
  for (const Estimate& e : r.fit.estimates) {
    const std::string name = estimate_name(e, r.problem);
    const ParameterInfo info = parameter_info(e.parameter, r.problem.start.terms);
    figures[name] = figure(e.value, reported_u(e), info.unit, steps);
    estimates.push_back(
        {{"name", info.name},
         {"symbol", info.symbol},
         {"flight", e.flight < 0 ? ordered_json(nullptr) : ordered_json(r.flights[static_cast<std::size_t>(e.flight)].name)},
         {"value", number(e.value)},
         {"u", number(e.u)},
         {"u_robust", number(e.u_robust)},
         {"prior_share", number(e.prior_share)},
         {"unit", info.unit},
         {"mark", mark_of(e)}});
  }
  for (const DerivedQuantity& d : a.derived) figures[d.id] = figure(d.value, std::max(d.u, d.u_robust), d.unit, steps);
  figures["cost_per_degree_of_freedom"] = figure(2.0 * r.fit.cost / r.fit.degrees_of_freedom, NAN, "1", steps);
  figures["log_likelihood"] = figure(r.fit.log_likelihood, NAN, "1", steps);
  j["figures"] = figures;
  j["estimates"] = estimates;
  ordered_json covariance = ordered_json::array();
  for (Eigen::Index row = 0; row < r.fit.covariance.rows(); ++row) {
    ordered_json line = ordered_json::array();
    for (Eigen::Index col = 0; col < r.fit.covariance.cols(); ++col) line.push_back(number(r.fit.covariance(row, col)));
    covariance.push_back(line);
  }
  j["covariance"] = covariance;

  ordered_json stages = ordered_json::array();
  for (const StageComparison& c : r.comparison) {
    stages.push_back({{"stage", name(c.role)},
                      {"parameter", parameter_info(c.parameter, r.problem.start.terms).symbol},
                      {"value", number(c.stage)},
                      {"u", number(c.u_stage)},
                      {"joint", number(c.joint)},
                      {"u_joint", number(c.u_joint)},
                      {"z", number(c.z)},
                      {"agrees", c.agrees}});
  }
  j["stages"] = stages;
  ordered_json white = ordered_json::array(), homogeneity = ordered_json::array(), checks = ordered_json::array();
  for (const FlightWhiteness& w : a.whiteness) white.push_back(whiteness_json(w));
  j["whiteness"] = white;
  for (const ParameterHomogeneity& h : a.homogeneity.parameters) {
    homogeneity.push_back({{"parameter", parameter_info(h.parameter, r.problem.start.terms).symbol},
                           {"chi2", number(h.chi2)},
                           {"degrees", h.degrees},
                           {"p", number(h.p)},
                           {"moved", h.moved}});
  }
  j["homogeneity"] = {{"chi2", number(a.homogeneity.chi2)},
                      {"degrees", a.homogeneity.degrees},
                      {"p", number(a.homogeneity.p)},
                      {"inflation", number(a.inflation)},
                      {"parameters", homogeneity}};
  j["observability"] = observability_json(a.observability);
  if (a.held_out) j["held_out"] = held_out_json(*a.held_out);
  for (const CheckedFlight& c : checked) checks.push_back(ordered_json::parse(findings_json(c)));
  j["checks"] = checks;
  j["fit"] = {{"iterations", r.fit.iterations},
              {"noise_rounds", r.fit.noise_rounds},
              {"noise_settled", r.fit.noise_settled},
              {"converged", r.fit.converged},
              {"states", steps},
              {"flights", r.flights.size()}};
  if (a.solver_check) j["solver_check"] = solver_check_json(*a.solver_check);
  j["warnings"] = warnings_json(r, a);
  j["errors"] = ordered_json::array();
  return j.dump(1) + "\n";
}

TrailPoint read_trail_point(const std::filesystem::path& given) {
  const auto path = std::filesystem::is_directory(given) ? given / "result.json" : given;
  const auto fail = [&](const std::string& what) {
    throw Error({path.generic_string(), what, "", "name folders that `rotorloop identify --report` wrote"});
  };
  std::ifstream in(path);
  if (!in) fail("cannot be read");
  const auto j = nlohmann::json::parse(in, nullptr, false);
  if (j.is_discarded() || !j.is_object()) fail("is no JSON document");
  if (j.value("command", "") != "identify") fail("is no result of `rotorloop identify`");
  if (j.value("format", 0) != 1) fail("has a format that this program does not know");
  TrailPoint out;
  out.label = path.parent_path().filename().generic_string();
  if (!j.contains("estimates") || !j.at("estimates").is_array()) fail("holds no estimates");
  for (const auto& e : j.at("estimates")) {
    for (const char* key : {"flight", "symbol", "unit", "value", "u", "u_robust"}) {
      if (!e.is_object() || !e.contains(key)) fail(std::string("holds an estimate without ") + key);
    }
    if (!e.at("flight").is_null() || !e.at("value").is_number() || !e.at("u").is_number()) continue;
    out.names.push_back(e.at("symbol").get<std::string>());
    out.units.push_back(e.at("unit").get<std::string>());
    out.value.push_back(e.at("value").get<double>());
    out.u.push_back(std::max(e.at("u").get<double>(), e.at("u_robust").is_number() ? e.at("u_robust").get<double>() : 0.0));
  }
  return out;
}

}  // namespace rotorloop::bench
