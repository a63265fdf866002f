#include "bench/identify/report/report_tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "bench/identify/identified_vehicle.hpp"
#include "bench/identify/report/identify_text.hpp"
#include "bench/identify/report/report_cells.hpp"
#include "bench/render/svg_pieces.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kTold = 2.0;  // |z| from which a difference is shown in red

// Red only where the file knows: to move away from a guess is what a fit is for.
std::string z_cell(const Said& s) {
  return cell(num(s.z, "{:.1f}"), std::fabs(s.z) > kTold && s.origin != host::Origin::guess ? "fail" : "");
}

// Long names of terms' parameters break after the term, or they push the last columns off the page.
std::string symbol_cell(const std::string& symbol) {
  std::string text = render::xml_escaped(symbol);
  if (const auto dot = text.find('.'); dot != std::string::npos) text.insert(dot + 1, "<br>");
  return cell(text, "l");
}

std::string value_cells(const ParameterRow& row) {
  if (!row.estimate) return cell(num(row.value, "{:.5g}")) + cell("") + cell("") + cell("");
  return cell(num(row.value, "{:.5g}"), "big") + cell(plus_minus(reported_u(*row.estimate))) + cell(two(row.estimate->u)) +
         cell(two(row.estimate->u_robust));
}

std::string quaternion(const Eigen::Quaterniond& q) {
  return fmt::format("{}, {}, {}, {}", num(q.w(), "{:.6f}"), num(q.x(), "{:.6f}"), num(q.y(), "{:.6f}"), num(q.z(), "{:.6f}"));
}

std::string rotation_html(const Identification& r) {
  const auto q = sensor_rotation(r);
  if (!q) return "";
  return fmt::format(
      "<p>q_BS,x to z are the rotation vector of the sensor about the start value ({}). The quaternion itself, sensor to body, w x y z: "
      "<b>{}</b>.</p>\n",
      quaternion(r.problem.start.start_q_BS), quaternion(*q));
}

std::string thrust_html(const IdentifyPage& p) {
  const FileComparison& c = p.comparison;
  const DerivedQuantity* found = derived_named("static_c_t", p.analysis.derived);
  if (c.static_thrust.empty() || !found) return "";
  std::string out = fmt::format(
      "<h3>Static thrust of these flights beside other measurements</h3>\n<p>These flights: c_t {} {} {}. Entries of the files, at the air "
      "density of the start file; the difference is how far these flights lie above.</p>\n",
      num(found->value, "{:.5g}"), plus_minus(std::max(found->u, found->u_robust)), page_unit(found->unit));
  out += head({left("file"), left("origin"), "c_t", "u", left("unit"), "difference, %", "z", "speeds, RPM"});
  for (const ThrustBeside& t : c.static_thrust) {
    out += "<tr>" + left_cell(t.label) + left_cell(std::string(host::name(t.said.origin))) + cell(num(t.said.value, "{:.5g}")) +
           cell(plus_minus(t.said.u)) + left_cell(page_unit(found->unit)) + cell(num(t.said.percent, "{:+.2f}"), "big") + z_cell(t.said) +
           cell(fmt::format("{:.0f} … {:.0f}", t.rpm_window[0], t.rpm_window[1])) + "</tr>\n";
  }
  return out + kTableEnd;
}

}  // namespace

std::string parameters_html(const IdentifyPage& p) {
  const Identification& r = p.result;
  std::string out =
      head({left("parameter"), "estimate", "u", "classical", "robust", left("unit"), left(""), "file said", left("origin"), "z"});
  for (std::size_t i = 0; i < p.comparison.rows.size(); ++i) {
    const ParameterRow& row = p.comparison.rows[i];
    const estimate::ParameterInfo info = estimate::parameter_info(row.parameter, r.problem.start.terms);
    const std::string mark = row.estimate ? mark_of(*row.estimate) : "held";
    out += "<tr>" + symbol_cell(row.symbol) + value_cells(row) + left_cell(page_unit(info.unit));
    out += left_cell(mark, mark == "model error" ? "fail" : "");
    if (const auto& s = p.comparison.start.parameters[i]) {
      out += cell(num(s->value) + " " + plus_minus(s->u)) + left_cell(std::string(host::name(s->origin))) + z_cell(*s);
    } else {
      out += cell("–") + left_cell("–") + cell("–");
    }
    out += "</tr>\n";
  }
  out += kTableEnd + rotation_html(r);
  out += "<h3>What follows from them</h3>\n" +
         head({left("quantity"), "value", "u", "u classical", "u robust", left("unit"), left("meaning")});
  for (const DerivedQuantity& d : p.analysis.derived) {
    out += "<tr>" + left_cell(d.symbol) + cell(num(d.value, "{:.5g}"), "big") + cell(plus_minus(std::max(d.u, d.u_robust))) +
           cell(two(d.u)) + cell(two(d.u_robust)) + left_cell(page_unit(d.unit)) + left_cell(d.meaning) + "</tr>\n";
  }
  return out + kTableEnd;
}

std::string beside_html(const IdentifyPage& p) {
  const FileComparison& c = p.comparison;
  const std::string thrust = thrust_html(p);
  if (c.beside.empty() && thrust.empty()) return "";
  std::string out = "<h2 id=\"beside\">Beside what is known otherwise</h2>\n";
  if (c.beside.empty()) return out + thrust;
  out +=
      "<p>The difference is how far these flights lie above the file, z the same in standard uncertainties of the difference where the "
      "file "
      "gives one; red beyond 2 where the file does not guess. What follows from a file's values has no u of its own.</p>\n";
  std::vector<HeadCell> above{{"", true, 3}}, names{left("parameter"), "these flights", left("unit")};
  for (const BesideColumn& b : c.beside) {
    above.push_back({b.label, true, 5});
    names.insert(names.end(), {"value", "u", left("origin"), "difference, %", "z"});
  }
  out += head(names, above);
  for (std::size_t i = 0; i < c.rows.size(); ++i) {
    const auto says = [&](const BesideColumn& b) { return b.parameters[i].has_value(); };
    if (std::none_of(c.beside.begin(), c.beside.end(), says)) continue;
    const ParameterRow& row = c.rows[i];
    out += "<tr>" + left_cell(row.symbol) + cell(num(row.value, "{:.5g}") + (row.estimate ? "" : " (held)"), row.estimate ? "big" : "") +
           left_cell(page_unit(estimate::parameter_info(row.parameter, p.result.problem.start.terms).unit));
    for (const BesideColumn& b : c.beside) {
      if (const auto& s = b.parameters[i]) {
        out += cell(num(s->value)) + cell(plus_minus(s->u)) + left_cell(std::string(host::name(s->origin))) +
               cell(num(s->percent, "{:+.1f}")) + z_cell(*s);
      } else {
        out += cell("–") + cell("") + left_cell("") + cell("") + cell("");
      }
    }
    out += "</tr>\n";
  }
  for (std::size_t i = 0; i < p.analysis.derived.size(); ++i) {
    const DerivedQuantity& d = p.analysis.derived[i];
    out += (i == 0 ? "<tr class=\"first\">" : "<tr>") + left_cell(d.symbol) + cell(num(d.value, "{:.5g}"), "big") +
           left_cell(page_unit(d.unit));
    for (const BesideColumn& b : c.beside)
      out += cell(num(b.derived[i].value)) + cell("") + left_cell("") + cell(num(b.derived[i].percent, "{:+.1f}")) + cell("");
    out += "</tr>\n";
  }
  return out + kTableEnd + thrust;
}

std::string noise_html(const IdentifyPage& p) {
  const Identification& r = p.result;
  std::string out =
      "<h2 id=\"noise\">Noise figures</h2>\n<p>q_a and q_α say how far the motion wanders from the model, as root densities of white "
      "acceleration along the world's axes and of angular acceleration about the body's; the others are standard deviations of one "
      "reading. " +
      std::string(p.provenance.conditions.noise == "fixed" ? "They were given and kept (--noise fixed)."
                                                           : "They were found together with the parameters.") +
      "</p>\n";
  out += head({left("flight"), left("figure"), "x", "y", "z", left("unit")});
  for (std::size_t f = 0; f < r.flights.size(); ++f) {
    const estimate::GridFlight& g = r.flights[f];
    const estimate::NoiseModel& n = r.fit.noise[f];
    bool first = true;
    const auto row = [&](bool has, const char* figure, const Eigen::Vector3d& v, const char* unit) {
      if (!has) return;
      const std::string flight =
          first ? fmt::format("{} ({:.0f} s at {:.4g} Hz)", g.name, static_cast<double>(g.tied_knots()) * g.step_s, 1.0 / g.step_s) : "";
      out += fmt::format("<tr{}>", first ? " class=\"first\"" : "") + left_cell(flight) + left_cell(figure) + cell(num(v[0], "{:.3g}")) +
             cell(num(v[1], "{:.3g}")) + cell(num(v[2], "{:.3g}")) + left_cell(unit) + "</tr>\n";
      first = false;
    };
    row(true, "q_a", n.force_m_s2_rtHz, "m/s²/√Hz");
    row(true, "q_α", n.angular_rad_s2_rtHz, "rad/s²/√Hz");
    row(!g.pose.empty() || !g.position.empty(), "position", n.position_m, "m");
    row(!g.pose.empty(), "attitude", n.attitude_rad, "rad");
    row(!g.velocity.empty(), "velocity", n.velocity_m_s, "m/s");
    row(!g.gyro.empty(), "gyro", n.gyro_rad_s, "rad/s");
    row(!g.accel.empty(), "accelerometer", n.accel_m_s2, "m/s²");
  }
  return out + kTableEnd;
}

std::vector<std::pair<std::string, std::string>> conditions_facts(const IdentifyPage& p) {
  const IdentifyConditions& c = p.provenance.conditions;
  const Identification& r = p.result;
  std::vector<std::pair<std::string, std::string>> out{{"rotorloop", p.provenance.version}, {"git", p.provenance.git}};
  out.emplace_back("start", c.vehicle_file);
  std::vector<std::string> terms, held;
  for (std::size_t t = 0; t < r.problem.start.terms.size(); ++t) terms.emplace_back(r.problem.start.terms.term(t).info.id);
  for (const ParameterRow& row : p.comparison.rows) {
    if (!row.estimate) held.push_back(row.symbol);
  }
  const auto listed = [](const std::vector<std::string>& names) {
    return names.empty() ? std::string("none") : fmt::format("{}", fmt::join(names, ", "));
  };
  out.emplace_back("added terms", listed(terms));
  out.emplace_back("held", listed(held));
  if (!c.per_flight.empty()) out.emplace_back("per flight", listed(c.per_flight));
  if (!c.free.empty()) out.emplace_back("freed", listed(c.free));
  out.emplace_back("readings", listed(c.use) == "none" ? "poses" : "poses, " + listed(c.use));
  out.emplace_back("noise", c.noise);
  out.emplace_back("rate", c.rate_Hz > 0.0 ? num(c.rate_Hz) + " Hz" : "as poses");
  out.emplace_back("solver", c.solver);
  const auto bound = [](double s, const char* none) { return std::fabs(s) < 1e300 ? num(s) + " s" : std::string(none); };
  out.emplace_back("window", std::fabs(c.from_s) < 1e300 || std::fabs(c.to_s) < 1e300
                                 ? bound(c.from_s, "start") + " to " + bound(c.to_s, "end")
                                 : std::string("whole flights"));
  return out;
}

}  // namespace rotorloop::identify
