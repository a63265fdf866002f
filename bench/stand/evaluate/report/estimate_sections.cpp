#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/render/page.hpp"
#include "bench/render/zoom_plot.hpp"
#include "bench/stand/evaluate/report/estimate_document.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::stand {
namespace {

using render::Cell;
using render::figure_text;
using render::left;

std::string percent(double share, const char* format = "{:.2f}") {
  return std::isfinite(share) ? figure_text(100.0 * share, format) + " %" : "–";
}

const CoefficientEstimate* channel(const StandEstimate& e, bool thrust) {
  const auto& c = thrust ? e.thrust : e.torque;
  return c ? &*c : nullptr;
}

render::Table coefficients_table(const StandEstimate& e) {
  render::Table t{{left("coefficient"), {"value"}, {"u"}, {"u, %"}, {"95 %"}, {"local exponent"}, {"c ω² alone"}}};
  for (const bool thrust : {true, false}) {
    const CoefficientEstimate* c = channel(e, thrust);
    if (!c) continue;
    t.rows.push_back(
        {{c->name + ", " + render::unit_text(c->unit), Cell(render::measured_figure(c->value, c->u), "big"), render::measured_u(c->u),
          percent(c->u / c->value), figure_text(c->low) + " … " + figure_text(c->high),
          c->exponent_u > 0.0 ? render::measured_figure(c->exponent, c->exponent_u) + " " + render::uncertainty_text(c->exponent_u) : "2",
          figure_text(c->proportional)}});
  }
  return t;
}

render::Table budget_table(const CoefficientEstimate& c) {
  render::Table t{{left("term of " + c.name), left("type"), {"u, %"}, {"share, %"}, left("from")}};
  const double total2 = std::pow(c.u / c.value, 2);
  for (const BudgetTerm& b : c.budget)
    t.rows.push_back({{b.name, b.kind == BudgetKind::A ? "A" : "B", figure_text(100.0 * b.u, "{:.3f}"),
                       figure_text(100.0 * b.u * b.u / total2, "{:.0f}"), b.source}});
  t.rows.push_back(
      {{Cell("combined", "big"), "", Cell(figure_text(100.0 * c.u / c.value, "{:.3f}"), "big"), "100",
        c.degrees < 1e5 ? fmt::format("{:.0f} degrees of freedom, k = {:.2f}", c.degrees, coverage_factor(c.degrees)) : "k = 1.96"},
       true});
  return t;
}

render::Table laws_table(const CoefficientEstimate& c) {
  render::Table t{{left("law of " + c.channel), {c.name + " at the middle"}, {"exponent"}, {"AICc above the best"}, {"rms"}}};
  for (const LawRow& l : c.laws)
    t.rows.push_back({{l.text, figure_text(l.c), figure_text(2.0 + l.exponent, "{:.3f}"), figure_text(l.aicc_loss, "{:.1f}"),
                       figure_text(l.rms, "{:.3g}")}});
  return t;
}

std::vector<std::string> notes_of(const CoefficientEstimate& c) {
  std::vector<std::string> out;
  if (c.square_fails)
    out.push_back(
        fmt::format("{}: c ω² loses by more than {:.0f} AICc: {} holds at the middle of the window alone, where it goes with ω^{:.2f}; "
                    "compare it with flights at this speed only",
                    c.channel, kAicLoss, c.name, c.exponent - 2.0));
  out.push_back(fmt::format("{}: bootstrap over steps u {} (seed {}, {} draws, 95 %: {:.4g} to {:.4g}), model-based {}: the cross-check",
                            c.channel, percent(c.bootstrap.u / c.value, "{:.3f}"), c.bootstrap.seed, c.bootstrap.draws, c.bootstrap.low,
                            c.bootstrap.high, percent(c.model_based_u / c.value, "{:.3f}")));
  std::string terms;
  for (const FittedTerm& t : c.fit.terms)
    if (t.name == "zero" || t.name == "running offset" || t.name == "drift" || t.name == "hysteresis")
      terms += fmt::format("{}{} {:.3g} ± {:.2g}", terms.empty() ? "" : ", ", t.name, t.value, t.u);
  if (!terms.empty()) out.push_back(fmt::format("{}: fitted beside it, {}: {}", c.channel, c.channel == "thrust" ? "N" : "N m", terms));
  for (const auto& w : c.down_weighted) out.push_back(c.channel + ": down-weighted: " + w);
  return out;
}

render::Table derived_table(const StandEstimate& e, double reference) {
  render::Table t{{left("derived"), {"value"}, left("")}};
  const auto add = [&](const char* name, double v, const std::string& unit, const std::string& note) {
    if (v == v) t.rows.push_back({{name, figure_text(v) + (unit.empty() ? "" : " " + unit), note}});
  };
  const double u_t = e.thrust ? e.thrust->u / e.thrust->value : 0.0, u_q = e.torque ? e.torque->u / e.torque->value : 0.0;
  add("C_T", e.C_T, "", "T/(ρ n² D⁴), u " + percent(u_t));
  add("C_Q", e.C_Q, "", "Q/(ρ n² D⁵), u " + percent(u_q));
  add("C_P", e.C_P, "", "2π C_Q");
  add("figure of merit", e.figure_of_merit, "", "unit check: 0.4 to 0.75 for small propellers, about 0.05 where RPM were taken as rad/s");
  const std::string at = fmt::format("reduced to {:.4g} kg/m³", reference);
  add("c_t", e.reduced_c_t, "N s²", at);
  add("c_q", e.reduced_c_q, "N m s²", at);
  add("thrust per electrical power", e.grams_per_watt, "g/W", "at the middle of the window");
  return t;
}

// As a maker's data sheet has them.
render::Table operating_table(const StandEstimate& e) {
  render::Table t{{{"RPM"},
                   {"thrust, g"},
                   {"thrust, N"},
                   {"torque, N m"},
                   {"motor, V"},
                   {"supply, V"},
                   {"current, A"},
                   {"power, W"},
                   {"g/W"},
                   {"N/A"},
                   {"efficiency, %"}}};
  for (const OperatingPoint& p : levels_of(e.points))
    t.rows.push_back(
        {{figure_text(p.omega_rad_s * kRpm_per_rad_s, "{:.0f}"), figure_text(p.thrust_g(), "{:.0f}"), figure_text(p.thrust_N, "{:.3f}"),
          figure_text(p.torque_N_m, "{:.4f}"), figure_text(p.motor_V, "{:.2f}"), figure_text(p.supply_V, "{:.2f}"),
          figure_text(p.current_A, "{:.2f}"), figure_text(p.electrical_W(), "{:.1f}"), figure_text(p.grams_per_watt(), "{:.2f}"),
          figure_text(p.newtons_per_ampere(), "{:.3f}"), figure_text(100.0 * p.drive_efficiency(), "{:.1f}")}});
  return t;
}

render::Table motor_table(const StandEstimate& e) {
  render::Table t{{left("motor and rotor"), {"value"}, {"u"}, left("")}};
  const auto add = [&](const std::string& name, const MotorValue& v, const std::string& unit, const std::string& note) {
    t.rows.push_back({{name + ", " + unit, render::measured_figure(v.value, v.u), render::measured_u(v.u), note}});
  };
  if (e.motor) {
    const MotorConstants& m = *e.motor;
    add("K_v", m.speed_constant_rpm_V, "RPM/V", "no-load speed per volt of line-to-line EMF amplitude");
    const std::string at =
        m.winding_degC == m.winding_degC ? fmt::format("at {:.0f} °C", m.winding_degC) : "at a temperature that is not recorded";
    add("R", m.resistance_ohm, "Ω",
        fmt::format("one phase with the switches, {}, {}", m.winding ? "measured by the ESC at rest" : "of the run's power", at));
    if (m.winding) {
      const MeasuredWinding& w = *m.winding;
      add("R of the winding", {w.winding_ohm, w.u_resistance * w.phase_ohm}, "Ω", "less the switches");
      add("L_d", {w.inductance_d_H, w.u_inductance * w.inductance_d_H}, "H", "one phase, at 0 A, by the ESC at rest");
      add("L_q", {w.inductance_q_H, w.u_inductance * w.inductance_q_H}, "H", "the same across the magnet");
    }
    if (m.flux_linkage_Wb) add("flux linkage", *m.flux_linkage_Wb, "Wb", "one phase, peak");
    if (m.no_load_current_A) add("I_0", *m.no_load_current_A, "A", "current amplitude without shaft torque");
    if (m.friction_N_m) add("friction", *m.friction_N_m, "N m", "I_0 as torque");
  }
  if (e.dynamics) {
    const RunDynamics& d = *e.dynamics;
    if (d.up)
      add("time constant, up", {d.up->value_s, d.up->u_s}, "s", fmt::format("{} steps, delay {:.1f} ms", d.up->steps, 1e3 * d.up->delay_s));
    if (d.down)
      add("time constant, down", {d.down->value_s, d.down->u_s}, "s",
          fmt::format("{} steps, delay {:.1f} ms", d.down->steps, 1e3 * d.down->delay_s));
    if (d.inertia_kg_m2)
      add("J, rotor and propeller", {*d.inertia_kg_m2, d.inertia_u_kg_m2.value_or(0.0)}, "kg m²", "from the reaction torque on the mount");
    // Where a frequency was not reached the loop is at least as fast as the last that was seen.
    const auto found = [&](double f_Hz) {
      return std::isfinite(f_Hz) ? figure_text(f_Hz, "{:.2f}") : fmt::format("above {:.2g}", d.bandwidth->to_Hz);
    };
    if (d.bandwidth)
      t.rows.push_back({{"speed loop, Hz", found(d.bandwidth->minus_3dB_Hz), "",
                         fmt::format("-3 dB; -90° at {} Hz; coherence above {} from {:.2g} to {:.2g} Hz",
                                     found(d.bandwidth->minus_90deg_Hz), kCoherenceGate, d.bandwidth->from_Hz, d.bandwidth->to_Hz)}});
  }
  return t;
}

void add_advance(render::Section& s, const AdvanceTorque& a) {
  s.blocks.push_back(render::Paragraph{
      fmt::format("Torque in axial wind, J from {:.2f} to {:.2f}: Q = ω² (c_q0 + c_q2 J²), c_q0 = {} N m s², c_q2 = {} N m s² (correlation "
                  "{:.2f}); rms {:.1f} mN m, of a constant {:.1f} mN m.",
                  a.j_low, a.j_high, render::measured_figure(a.c_q0_N_m_s2, a.u0_N_m_s2) + " " + render::uncertainty_text(a.u0_N_m_s2),
                  render::measured_figure(a.c_q2_N_m_s2, a.u2_N_m_s2) + " " + render::uncertainty_text(a.u2_N_m_s2), a.correlation,
                  1e3 * a.rms_N_m, 1e3 * a.constant_rms_N_m)});
  render::Table t{{left("fitted at"), left("predicted"), {"c_q(J), mN m rms"}, {"constant, mN m rms"}, {"share, %"}}};
  for (const AirspeedTrial& x : a.trials)
    t.rows.push_back(
        {{fmt::format("{:.1f} m/s", x.fitted_m_s), fmt::format("{:.1f} m/s", x.predicted_m_s), figure_text(1e3 * x.rms_N_m, "{:.2f}"),
          figure_text(1e3 * x.constant_rms_N_m, "{:.2f}"), figure_text(100.0 * x.rms_N_m / x.constant_rms_N_m, "{:.0f}")}});
  if (!t.rows.empty()) s.blocks.push_back(t);
}

// What the run was measured with. A profile that nobody has seen on hardware is a reason to doubt every figure above.
void add_instruments(render::Section& s, const RunFacts& f) {
  if (f.simulated)
    s.blocks.push_back(render::Paragraph{"Simulated: no motor turned, and the instruments were emulated from their profiles."});
  if (f.instruments.empty()) return;
  render::Table t{{left("axis"), left("read by"), left("channel"), left("evidence"), left("source of its registers")}};
  for (const Instrument& i : f.instruments)
    t.rows.push_back({{i.axis, i.model, i.channel,
                       i.evidence == "manual" ? "manual: copied from documents, not seen on hardware" : i.evidence, i.source}});
  s.blocks.push_back(t);
  if (!f.calibrated_on.empty())
    s.blocks.push_back(render::Paragraph{"Calibrated on " + f.calibrated_on +
                                         (f.calibration_expires.empty() ? "." : ", until " + f.calibration_expires + ".")});
}

render::Section file_section(const EstimatedFile& f, std::size_t number, bool with_figures, double reference) {
  const StandEstimate& e = f.estimate;
  render::Section s{e.name, fmt::format("run-{}", number)};
  if (!e.faults.empty()) s.blocks.push_back(render::List{e.faults, "warn"});
  std::string what = fmt::format("{} steps, {} zeros", e.steps, e.zeros);
  if (e.centre_rad_s > 0.0)
    what += fmt::format("; window {:.0f} to {:.0f} RPM, middle {:.0f} RPM", e.window_rad_s[0] * kRpm_per_rad_s,
                        e.window_rad_s[1] * kRpm_per_rad_s, e.centre_rad_s * kRpm_per_rad_s);
  if (e.facts.air_density_kg_m3 == e.facts.air_density_kg_m3) what += fmt::format("; air {:.4g} kg/m³", e.facts.air_density_kg_m3);
  if (e.facts.diameter_m == e.facts.diameter_m) what += fmt::format("; diameter {:.4g} m", e.facts.diameter_m);
  s.blocks.push_back(render::Paragraph{what});
  if (e.thrust || e.torque) s.blocks.push_back(coefficients_table(e));
  if (with_figures) s.blocks.push_back(render::Markup{estimate_figures(e)});
  for (const bool thrust : {true, false})
    if (const CoefficientEstimate* c = channel(e, thrust)) {
      s.blocks.push_back(budget_table(*c));
      s.blocks.push_back(laws_table(*c));
      s.blocks.push_back(render::List{notes_of(*c)});
    }
  if (const auto t = derived_table(e, reference); !t.rows.empty()) s.blocks.push_back(t);
  if (const auto t = operating_table(e); !t.rows.empty()) s.blocks.push_back(t);
  if (with_figures) s.blocks.push_back(render::Markup{operating_figures(e)});
  if (const auto t = motor_table(e); !t.rows.empty()) s.blocks.push_back(t);
  if (f.advance) add_advance(s, *f.advance);
  if (with_figures) s.blocks.push_back(render::Markup{sample_figures(e)});
  add_instruments(s, e.facts);
  if (!e.remarks.empty()) s.blocks.push_back(render::List{e.remarks});
  return s;
}

render::Table components_table(const VarianceComponents& v, const std::string& name) {
  render::Table t{{left(name), {"standard deviation, %"}, {"95 %"}, {"degrees of freedom"}}};
  for (const VarianceComponent& c : v.components)
    t.rows.push_back(
        {{c.name, figure_text(100.0 * c.deviation, "{:.2f}"),
          figure_text(100.0 * c.low, "{:.2f}") + " … " + figure_text(100.0 * c.high, "{:.2f}"), figure_text(c.degrees, "{:.0f}")}});
  return t;
}

}  // namespace

render::Outcome estimate_outcome(const EstimateDocument& d) {
  render::Outcome o;
  std::size_t estimated = 0, faulty = 0, with_thrust = 0;
  for (const EstimatedFile& f : d.files) {
    estimated += f.estimate.thrust || f.estimate.torque || f.advance || f.estimate.dynamics;
    with_thrust += f.estimate.thrust.has_value();
    faulty += f.verdict == "faulty" || !f.estimate.faults.empty();
    for (const auto& fault : f.estimate.faults) o.errors.push_back(f.estimate.name + ": " + fault);
  }
  // A refusal always says why.
  if (estimated == 0 && o.errors.empty())
    for (const EstimatedFile& f : d.files)
      o.errors.push_back(fmt::format("{}: no coefficient from {} step{} in still air: five different speeds part it from zero and offset",
                                     f.estimate.name, f.estimate.steps, f.estimate.steps == 1 ? "" : "s"));
  o.verdict = estimated == 0 ? "refused" : "estimated";
  o.standing = estimated == 0 ? render::Standing::bad : faulty > 0 ? render::Standing::open : render::Standing::good;
  o.sentence = fmt::format("{} of {} files estimated{}", estimated, d.files.size(),
                           faulty > 0 ? fmt::format("; {} with a faulty channel, named below", faulty) : "");
  o.next = estimated == 0     ? "correct what is named and measure again"
           : with_thrust == 0 ? "rotorloop stand run --sequence staircase gives the coefficients"
                              : "rotorloop stand compare sets c_t against flights; the terms of the budget marked typical are worth a look "
                                "in your own calibration";
  return o;
}

render::Sections estimate_sections(const EstimateDocument& d, bool with_figures) {
  render::Sections out;
  for (std::size_t i = 0; i < d.files.size(); ++i) out.push_back(file_section(d.files[i], i + 1, with_figures, d.reference_density_kg_m3));
  if (d.c_t_components || d.c_q_components) {
    render::Section s{"Components of variance", "variance"};
    for (const auto& [v, name] : {std::pair{&d.c_t_components, "c_t"}, std::pair{&d.c_q_components, "c_q"}})
      if (*v)
        s.blocks.push_back(components_table(
            **v, fmt::format("{} of {} files, {} propellers, {} mounts", name, (*v)->values, (*v)->propellers, (*v)->mounts)));
    s.blocks.push_back(
        render::Paragraph{"Nested random effects by the method of moments, on the logarithm; intervals after Williams and Tukey. A file "
                          "with a faulty channel has no part in it."});
    out.push_back(std::move(s));
  }
  if (!d.remarks.empty()) out.push_back({"Files against each other", "files", {render::List{d.remarks}}});
  return out;
}

std::string estimate_text(const EstimateDocument& d) {
  return render::terminal_text(estimate_sections(d, false)) + "\n" + render::outcome_text(estimate_outcome(d));
}

std::string estimate_page(const EstimateDocument& d) {
  std::string out =
      render::page_begin("Thrust stand: coefficients and their uncertainty",
                         d.files.size() == 1 ? d.files[0].estimate.name : fmt::format("{} files", d.files.size()), "rotorloop");
  out += render::banner_html(estimate_outcome(d)) + render::page_html(estimate_sections(d, true));
  render::Section s{"Provenance", "provenance", {render::Paragraph{d.version + "; " + d.command}}};
  std::vector<std::string> inputs;
  for (const auto& [path, hash] : d.inputs) inputs.push_back(path + "  sha256 " + hash);
  s.blocks.push_back(render::List{inputs});
  out += render::page_html({s});
  const bool zoomable = std::any_of(d.files.begin(), d.files.end(), [](const EstimatedFile& f) { return !f.estimate.samples.empty(); });
  return out + (zoomable ? render::zoom_script_html() : "") + render::page_end();
}

}  // namespace rotorloop::stand
