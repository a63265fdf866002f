#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

using Json = nlohmann::ordered_json;

Json number(double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); }

Json to_json(const CoefficientEstimate& c) {
  Json j{{"name", c.name},
         {"unit", c.unit},
         {"value", c.value},
         {"u", c.u},
         {"degrees_of_freedom", number(c.degrees)},
         {"interval_95", {c.low, c.high}},
         {"exponent", c.exponent},
         {"exponent_u", c.exponent_u},
         {"square_law_fails", c.square_fails},
         {"proportional", c.proportional},
         {"model_based_u", c.model_based_u},
         {"bootstrap",
          {{"u", c.bootstrap.u},
           {"interval_95", {c.bootstrap.low, c.bootstrap.high}},
           {"draws", c.bootstrap.draws},
           {"seed", c.bootstrap.seed}}}};
  j["budget"] = Json::array();
  for (const BudgetTerm& b : c.budget)
    j["budget"].push_back({{"name", b.name},
                           {"type", b.kind == BudgetKind::A ? "A" : "B"},
                           {"u_relative", b.u},
                           {"source", b.source},
                           {"degrees_of_freedom", number(b.degrees)}});
  j["terms"] = Json::array();
  for (const FittedTerm& t : c.fit.terms) j["terms"].push_back({{"name", t.name}, {"value", t.value}, {"u", t.u}});
  j["laws"] = Json::array();
  for (const LawRow& l : c.laws)
    j["laws"].push_back({{"law", l.text}, {"c", l.c}, {"exponent", 2.0 + l.exponent}, {"aicc_loss", l.aicc_loss}, {"rms", l.rms}});
  j["down_weighted"] = c.down_weighted;
  return j;
}

Json to_json(const OperatingPoint& p) {
  return {{"rpm", p.omega_rad_s * kRpm_per_rad_s},
          {"thrust_N", number(p.thrust_N)},
          {"thrust_g", number(p.thrust_g())},
          {"torque_N_m", number(p.torque_N_m)},
          {"motor_V", number(p.motor_V)},
          {"supply_V", number(p.supply_V)},
          {"current_A", number(p.current_A)},
          {"electrical_W", number(p.electrical_W())},
          {"shaft_W", number(p.shaft_W())},
          {"grams_per_watt", number(p.grams_per_watt())},
          {"newtons_per_ampere", number(p.newtons_per_ampere())},
          {"drive_efficiency", number(p.drive_efficiency())}};
}

Json to_json(const MotorValue& v, const char* unit) { return {{"value", v.value}, {"u", v.u}, {"unit", unit}}; }

Json motor_json(const StandEstimate& e) {
  Json j = Json::object();
  if (e.motor) {
    j["speed_constant"] = to_json(e.motor->speed_constant_rpm_V, "RPM/V");
    j["resistance"] = to_json(e.motor->resistance_ohm, "ohm");
    j["resistance_from"] = e.motor->winding ? "ESC at rest" : "run";
    j["winding_degC"] = number(e.motor->winding_degC);
    if (const auto& w = e.motor->winding) {
      j["winding_resistance"] = to_json(MotorValue{w->winding_ohm, w->u_resistance * w->phase_ohm}, "ohm");
      j["inductance_d"] = to_json(MotorValue{w->inductance_d_H, w->u_inductance * w->inductance_d_H}, "H");
      j["inductance_q"] = to_json(MotorValue{w->inductance_q_H, w->u_inductance * w->inductance_q_H}, "H");
    }
    if (e.motor->flux_linkage_Wb) j["flux_linkage"] = to_json(*e.motor->flux_linkage_Wb, "Wb");
    if (e.motor->no_load_current_A) j["no_load_current"] = to_json(*e.motor->no_load_current_A, "A");
    if (e.motor->friction_N_m) j["friction"] = to_json(*e.motor->friction_N_m, "N m");
  }
  if (e.dynamics) {
    const RunDynamics& d = *e.dynamics;
    if (d.up) j["time_constant_up"] = to_json(MotorValue{d.up->value_s, d.up->u_s}, "s");
    if (d.down) j["time_constant_down"] = to_json(MotorValue{d.down->value_s, d.down->u_s}, "s");
    if (d.inertia_kg_m2) j["inertia"] = to_json(MotorValue{*d.inertia_kg_m2, d.inertia_u_kg_m2.value_or(0.0)}, "kg m2");
    if (d.bandwidth)
      j["bandwidth"] = {{"minus_3dB_Hz", number(d.bandwidth->minus_3dB_Hz)},
                        {"minus_90deg_Hz", number(d.bandwidth->minus_90deg_Hz)},
                        {"from_Hz", d.bandwidth->from_Hz},
                        {"to_Hz", d.bandwidth->to_Hz}};
  }
  return j;
}

Json advance_json(const AdvanceTorque& a) {
  Json j{{"c_q0", to_json(MotorValue{a.c_q0_N_m_s2, a.u0_N_m_s2}, "N m s2")},
         {"c_q2", to_json(MotorValue{a.c_q2_N_m_s2, a.u2_N_m_s2}, "N m s2")},
         {"correlation", a.correlation},
         {"j", {a.j_low, a.j_high}},
         {"rms_N_m", a.rms_N_m},
         {"constant_rms_N_m", a.constant_rms_N_m}};
  j["trials"] = Json::array();
  for (const AirspeedTrial& t : a.trials)
    j["trials"].push_back({{"fitted_m_s", t.fitted_m_s},
                           {"predicted_m_s", t.predicted_m_s},
                           {"rms_N_m", t.rms_N_m},
                           {"constant_rms_N_m", t.constant_rms_N_m}});
  return j;
}

Json components_json(const VarianceComponents& v) {
  Json j{{"values", v.values}, {"propellers", v.propellers}, {"mounts", v.mounts}, {"mean", v.mean}};
  j["components"] = Json::array();
  for (const VarianceComponent& c : v.components)
    j["components"].push_back({{"name", c.name},
                               {"relative_deviation", c.deviation},
                               {"interval_95", {number(c.low), number(c.high)}},
                               {"degrees_of_freedom", c.degrees}});
  return j;
}

}  // namespace

std::string estimate_json(const EstimateDocument& d) {
  const render::Outcome outcome = estimate_outcome(d);
  Json j{{"format", 1},
         {"command", "stand estimate"},
         {"version", d.version},
         {"verdict", outcome.verdict},
         {"errors", outcome.errors},
         {"next", outcome.next}};
  j["inputs"] = Json::array();
  for (const auto& [path, hash] : d.inputs) j["inputs"].push_back({{"path", path}, {"sha256", hash}});
  j["files"] = Json::array();
  for (const EstimatedFile& f : d.files) {
    const StandEstimate& e = f.estimate;
    Json one{{"file", e.name},
             {"verdict", f.verdict},
             {"motor_name", e.facts.motor},
             {"propeller", e.facts.propeller},
             {"steps", e.steps},
             {"zeros", e.zeros},
             {"window_rpm", {e.window_rad_s[0] * kRpm_per_rad_s, e.window_rad_s[1] * kRpm_per_rad_s}},
             {"air_density_kg_m3", number(e.facts.air_density_kg_m3)},
             {"diameter_m", number(e.facts.diameter_m)}};
    if (e.thrust) one["c_t"] = to_json(*e.thrust);
    if (e.torque) one["c_q"] = to_json(*e.torque);
    one["derived"] = {{"C_T", number(e.C_T)},
                      {"C_Q", number(e.C_Q)},
                      {"C_P", number(e.C_P)},
                      {"figure_of_merit", number(e.figure_of_merit)},
                      {"grams_per_watt", number(e.grams_per_watt)},
                      {"reference_density_kg_m3", d.reference_density_kg_m3},
                      {"reduced_c_t", number(e.reduced_c_t)},
                      {"reduced_c_q", number(e.reduced_c_q)}};
    one["simulated"] = e.facts.simulated;
    one["instruments"] = Json::array();
    for (const Instrument& i : e.facts.instruments)
      one["instruments"].push_back(
          {{"axis", i.axis}, {"model", i.model}, {"channel", i.channel}, {"evidence", i.evidence}, {"source", i.source}});
    one["operating_points"] = Json::array();
    for (const OperatingPoint& p : levels_of(e.points)) one["operating_points"].push_back(to_json(p));
    one["motor"] = motor_json(e);
    if (f.advance) one["torque_in_wind"] = advance_json(*f.advance);
    one["faults"] = e.faults;
    one["remarks"] = e.remarks;
    j["files"].push_back(std::move(one));
  }
  if (d.c_t_components) j["c_t_variance"] = components_json(*d.c_t_components);
  if (d.c_q_components) j["c_q_variance"] = components_json(*d.c_q_components);
  j["remarks"] = d.remarks;
  return j.dump(2) + "\n";
}

}  // namespace rotorloop::stand
