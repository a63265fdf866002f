#include "bench/sysid/identify/report/identify_result.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/sysid/identify/identified_vehicle.hpp"
#include "bench/sysid/identify/report/tree_values.hpp"

namespace rotorloop::identify {
namespace {

using nlohmann::ordered_json;

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

ordered_json observability_json(const Identification& r, const Observability& o) {
  ordered_json weakest = ordered_json::array(), pairs = ordered_json::array(), flights = ordered_json::array(),
               advice = ordered_json::array();
  for (const estimate::OpenDirection& d : o.weakest) {
    ordered_json parts = ordered_json::array();
    for (const auto& [name, share] : d.parts) parts.push_back({{"parameter", name}, {"share", share}});
    weakest.push_back({{"information", number(d.information)}, {"parts", parts}});
  }
  for (const CorrelatedPair& c : o.correlated) pairs.push_back({{"first", c.first}, {"second", c.second}, {"correlation", c.correlation}});
  for (const FlightContribution& f : o.flights)
    flights.push_back({{"flight", f.flight}, {"seconds", f.seconds}, {"cannot_tell", f.undetermined}, {"information", f.information}});
  for (const Advice& a : o.advice) advice.push_back({{"parameter", a.parameter}, {"why", a.why}, {"manoeuvre", a.manoeuvre}});
  return {{"condition", number(o.condition)},
          {"weakest", weakest},
          {"correlated", pairs},
          {"flights", flights},
          {"advice", advice},
          {"parameters", array_of(r.problem.free, [&](const estimate::FreeParameter& f) {
             return estimate::parameter_info(f.parameter, r.problem.start.terms).symbol;
           })}};
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
  j["told"] = difference_json(c.reported);
  j["to_the_end"] = difference_json(c.to_the_end);
  j["within_acceptance"] = within_acceptance(c.to_the_end);
  return j;
}

ordered_json quaternion_json(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// What a file says, and by how much the flights differ from it.
ordered_json said_json(const FileValue& s) {
  return {
      {"value", number(s.value)}, {"u", number(s.u)}, {"origin", host::name(s.origin)}, {"percent", number(s.percent)}, {"z", number(s.z)}};
}

ordered_json said_or_null(const std::optional<FileValue>& s) { return s ? said_json(*s) : ordered_json(nullptr); }

ordered_json held_json(const Identification& r, const ParameterRow& row, const std::optional<FileValue>& start) {
  const estimate::ParameterInfo info = estimate::parameter_info(row.parameter, r.problem.start.terms);
  return {{"name", info.name},          {"symbol", info.symbol},
          {"value", number(row.value)}, {"u", start ? number(start->u) : ordered_json(nullptr)},
          {"unit", info.unit},          {"origin", start ? ordered_json(host::name(start->origin)) : ordered_json(nullptr)},
          {"label", row.symbol},        {"file", said_or_null(start)}};
}

ordered_json comparison_json(const Identification& r, const FileComparison& c, const std::vector<DerivedQuantity>& derived) {
  ordered_json out = ordered_json::array();
  for (const ComparisonColumn& b : c.others) {
    ordered_json parameters = ordered_json::array(), follows = ordered_json::array();
    for (std::size_t i = 0; i < c.rows.size(); ++i) {
      if (!b.parameters[i]) continue;
      const auto& e = c.rows[i].estimate;
      ordered_json row = said_json(*b.parameters[i]);
      row["symbol"] = estimate::parameter_info(c.rows[i].parameter, r.problem.start.terms).symbol;
      row["label"] = c.rows[i].symbol;
      row["found"] = number(c.rows[i].value);
      row["held"] = !e;
      row["unit"] = estimate::parameter_info(c.rows[i].parameter, r.problem.start.terms).unit;
      row["flight"] = e && e->flight >= 0 ? ordered_json(r.flights[static_cast<std::size_t>(e->flight)].name) : ordered_json(nullptr);
      parameters.push_back(row);
    }
    for (std::size_t i = 0; i < b.derived.size(); ++i)
      follows.push_back({{"id", derived[i].id},
                         {"symbol", derived[i].symbol},
                         {"unit", derived[i].unit},
                         {"found", number(derived[i].value)},
                         {"value", number(b.derived[i].value)},
                         {"percent", number(b.derived[i].percent)}});
    out.push_back({{"file", b.label}, {"parameters", parameters}, {"derived", follows}});
  }
  return out;
}

ordered_json static_thrust_json(const FileComparison& c) {
  ordered_json out = ordered_json::array();
  for (const ThrustComparison& t : c.static_thrust) {
    ordered_json row = said_json(t.said);
    row["file"] = t.label;
    row["rpm_window"] = t.rpm_window;
    out.push_back(row);
  }
  return out;
}

ordered_json conditions_json(const Identification& r, const IdentificationRequest& c) {
  ordered_json terms = ordered_json::array();
  for (std::size_t t = 0; t < r.problem.start.terms.size(); ++t) terms.push_back(r.problem.start.terms.term(t).info.id);
  const auto bound = [](double s) { return std::fabs(s) < 1e300 ? ordered_json(s) : ordered_json(nullptr); };
  return {{"vehicle_file", c.vehicle.filename().generic_string()},
          {"terms", terms},
          {"noise", name(c.noise)},
          {"rate_Hz", c.fit.rate_Hz},
          {"solver", c.check_by_ceres ? "ceres" : "own"},
          {"from_s", bound(c.fit.from_s)},
          {"to_s", bound(c.fit.to_s)},
          {"drag_speed_m_s", c.drag_speed_m_s},
          {"robust_scale", c.robust_scale},
          {"block_s", c.block_s},
          {"use", c.fit.use},
          {"free", c.fit.free},
          {"hold", c.fit.hold},
          {"per_flight", c.fit.per_flight},
          {"thrust_scale", r.start.thrust_scale}};
}

// Of each flight; null for measurements that it does not have.
ordered_json noise_json(const Identification& r) {
  ordered_json out = ordered_json::array();
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::GridFlight& g = r.flights[f];
    const estimate::NoiseModel& n = r.fit.noise[f];
    const auto of = [](bool has, const Eigen::Vector3d& v) {
      return has ? ordered_json({number(v[0]), number(v[1]), number(v[2])}) : ordered_json(nullptr);
    };
    out.push_back({{"flight", g.name},
                   {"rate_Hz", number(1.0 / g.step_s)},
                   {"seconds", number(static_cast<double>(g.tied_nodes()) * g.step_s)},
                   {"q_a_m_s2_rtHz", of(true, n.force_m_s2_rtHz)},
                   {"q_alpha_rad_s2_rtHz", of(true, n.angular_rad_s2_rtHz)},
                   {"position_m", of(!g.pose.empty() || !g.position.empty(), n.position_m)},
                   {"attitude_rad", of(!g.pose.empty(), n.attitude_rad)},
                   {"velocity_m_s", of(!g.velocity.empty(), n.velocity_m_s)},
                   {"gyro_rad_s", of(!g.gyro.empty(), n.gyro_rad_s)},
                   {"accel_m_s2", of(!g.accel.empty(), n.accel_m_s2)}});
  }
  return out;
}

std::size_t grid_steps(const Identification& r) {
  std::size_t steps = 0;
  for (const estimate::GridFlight& g : r.flights) steps += g.nodes;
  return steps;
}

ordered_json figures_json(const Identification& r, const IdentifyAnalysis& a) {
  const std::size_t steps = grid_steps(r);
  ordered_json out = ordered_json::object();
  for (const estimate::Estimate& e : r.fit.estimates)
    out[estimate::estimate_name(e, r.problem)] =
        figure(e.value, reported_u(e), estimate::parameter_info(e.parameter, r.problem.start.terms).unit, steps);
  for (const DerivedQuantity& d : a.derived) out[d.id] = figure(d.value, std::max(d.u, d.u_robust), d.unit, steps);
  out["cost_per_degree_of_freedom"] = figure(2.0 * r.fit.cost / r.fit.degrees_of_freedom, NAN, "1", steps);
  out["log_likelihood"] = figure(r.fit.log_likelihood, NAN, "1", steps);
  return out;
}

ordered_json estimate_json(const Identification& r, const estimate::Estimate& e, const std::optional<FileValue>& start) {
  const estimate::ParameterInfo info = estimate::parameter_info(e.parameter, r.problem.start.terms);
  return {{"name", info.name},
          {"symbol", info.symbol},
          {"flight", e.flight < 0 ? ordered_json(nullptr) : ordered_json(r.flights[static_cast<std::size_t>(e.flight)].name)},
          {"value", number(e.value)},
          {"u", number(e.u)},
          {"u_robust", number(e.u_robust)},
          {"prior_share", number(e.prior_share)},
          {"unit", info.unit},
          {"mark", mark_of(e)},
          {"label", estimate::estimate_name(e, r.problem)},
          {"file", said_or_null(start)}};
}

ordered_json derived_json(const DerivedQuantity& d) {
  return {{"id", d.id},           {"symbol", d.symbol},
          {"meaning", d.meaning}, {"value", number(d.value)},
          {"u", number(d.u)},     {"u_robust", number(d.u_robust)},
          {"unit", d.unit}};
}

ordered_json matrix_json(const Eigen::MatrixXd& m) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index row = 0; row < m.rows(); ++row) {
    ordered_json line = ordered_json::array();
    for (Eigen::Index col = 0; col < m.cols(); ++col) line.push_back(number(m(row, col)));
    out.push_back(line);
  }
  return out;
}

ordered_json stage_json(const Identification& r, const StageComparison& c) {
  double alone = NAN;
  for (const StageResult& s : r.stages) {
    for (std::size_t i = 0; i < s.estimates.size(); ++i) {
      if (s.role == c.role && s.estimates[i].parameter == c.parameter) alone = s.u_alone[i];
    }
  }
  return {{"stage", name(c.role)},    {"parameter", estimate::parameter_info(c.parameter, r.problem.start.terms).symbol},
          {"value", number(c.stage)}, {"u", number(c.u_stage)},
          {"joint", number(c.joint)}, {"u_joint", number(c.u_joint)},
          {"z", number(c.z)},         {"agrees", c.agrees},
          {"u_alone", number(alone)}};
}

ordered_json homogeneity_json(const Identification& r, const IdentifyAnalysis& a) {
  ordered_json parameters = ordered_json::array();
  for (const ParameterHomogeneity& h : a.homogeneity.parameters) {
    ordered_json flights = ordered_json::array();
    for (std::size_t f = 0; f < h.value.size(); ++f)
      flights.push_back({{"flight", r.flights[f].name}, {"value", number(h.value[f])}, {"u", number(h.u[f])}});
    parameters.push_back({{"parameter", estimate::parameter_info(h.parameter, r.problem.start.terms).symbol},
                          {"chi2", number(h.chi2)},
                          {"degrees", h.degrees},
                          {"p", number(h.p)},
                          {"moved", h.moved},
                          {"flights", flights}});
  }
  return {{"chi2", number(a.homogeneity.chi2)},
          {"degrees", a.homogeneity.degrees},
          {"p", number(a.homogeneity.p)},
          {"inflation", number(a.inflation)},
          {"parameters", parameters}};
}

ordered_json fit_json(const Identification& r) {
  return {{"iterations", r.fit.iterations},
          {"noise_rounds", r.fit.noise_rounds},
          {"noise_settled", r.fit.noise_settled},
          {"converged", r.fit.converged},
          {"states", grid_steps(r)},
          {"flights", r.flights.size()}};
}

}  // namespace

ordered_json input_json(const log::InputHash& i) {
  ordered_json out{{"path", i.path}, {"sha256", i.sha256}};
  if (i.held_out) out["held_out"] = true;
  return out;
}

ordered_json inertia_json(const Identification& r) {
  ordered_json out = ordered_json::array();
  for (const InertiaByBand& a : r.inertia.axes)
    out.push_back({{"symbol", estimate::parameter_info(a.parameter, r.problem.start.terms).symbol},
                   {"value", number(a.value)},
                   {"u", number(a.u)},
                   {"explained", number(a.explained)},
                   {"delay_s", number(a.delay_s)},
                   {"joint", number(a.joint)},
                   {"u_joint", number(a.u_joint)},
                   {"taken", a.taken}});
  return out;
}

ordered_json identify_tree(const Identification& r, const IdentifyAnalysis& a, const FileComparison& compared,
                           const std::vector<log::CheckedFlight>& checked, const IdentifyProvenance& p) {
  ordered_json j = {{"format", 1}, {"command", "identify"}, {"version", p.version}, {"git", p.git}};
  for (const log::InputHash& i : p.inputs) j["inputs"].push_back(input_json(i));
  j["started_utc"] = p.started_utc;
  j["wall_s"] = p.wall_s;
  const render::Outcome outcome = identify_outcome(r, a, p);
  j["verdict"] = outcome.verdict;
  j["limits"] = ordered_json::array();
  j["figures"] = figures_json(r, a);
  // An estimate of its own in each flight has a row for each.
  const auto said_before = [&](const estimate::Estimate& e) -> std::optional<FileValue> {
    for (std::size_t i = 0; i < compared.rows.size(); ++i) {
      const auto& row = compared.rows[i].estimate;
      if (row && row->parameter == e.parameter && row->flight == e.flight) return compared.start.parameters[i];
    }
    return std::nullopt;
  };
  j["estimates"] = array_of(r.fit.estimates, [&](const estimate::Estimate& e) { return estimate_json(r, e, said_before(e)); });
  j["held"] = ordered_json::array();
  for (std::size_t i = 0; i < compared.rows.size(); ++i) {
    if (!compared.rows[i].estimate) j["held"].push_back(held_json(r, compared.rows[i], compared.start.parameters[i]));
  }
  j["derived"] = array_of(a.derived, derived_json);
  j["q_BS_wxyz"] = nullptr;
  if (const auto q = sensor_rotation(r)) j["q_BS_wxyz"] = quaternion_json(*q);
  j["start_q_BS_wxyz"] = quaternion_json(r.problem.start.start_q_BS);
  j["beside"] = comparison_json(r, compared, a.derived);
  j["static_thrust"] = static_thrust_json(compared);
  j["covariance"] = matrix_json(r.fit.covariance);
  j["stages"] = array_of(r.comparison, [&](const StageComparison& c) { return stage_json(r, c); });
  j["whiteness"] = array_of(a.whiteness, whiteness_json);
  j["homogeneity"] = homogeneity_json(r, a);
  j["observability"] = observability_json(r, a.observability);
  if (a.held_out) j["held_out"] = held_out_json(*a.held_out);
  j["checks"] = array_of(checked, [](const log::CheckedFlight& c) { return ordered_json::parse(log::findings_json(c)); });
  j["conditions"] = conditions_json(r, p.conditions);
  j["noise"] = noise_json(r);
  j["fit"] = fit_json(r);
  if (a.solver_check) j["solver_check"] = solver_check_json(*a.solver_check);
  j["inertia_by_band"] = inertia_json(r);
  j["warnings"] = array_of(warnings_of(r, a), [](const IdentifyWarning& w) { return ordered_json{{"where", w.where}, {"what", w.what}}; });
  j["errors"] = outcome.errors;
  j["next"] = outcome.next;
  return j;
}

ordered_json estimates_json(const Identification& r) {
  return array_of(r.fit.estimates, [&](const estimate::Estimate& e) { return estimate_json(r, e, std::nullopt); });
}

std::string identify_result_json(const Identification& r, const IdentifyAnalysis& a, const FileComparison& compared,
                                 const std::vector<log::CheckedFlight>& checked, const IdentifyProvenance& p) {
  return identify_tree(r, a, compared, checked, p).dump(1) + "\n";
}

}  // namespace rotorloop::identify
