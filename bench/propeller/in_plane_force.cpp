#include "bench/propeller/in_plane_force.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>

#include "bench/propeller/scaled_blade.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::propeller {
namespace {
constexpr double kDensity_kg_m3 = 1.2;
constexpr double kAdvanceStep = 0.02;
constexpr double kMostPitchRatio = 1.4;  // beyond, the blade stalls in hover and thrust falls with pitch
// The reference quadrotor, paper Table I: mass, in-plane rotor drag F = c_dh T v, rotor radius; hover 8950 rpm from its k1, k2.
constexpr double kReferenceMass_kg = 0.682, kReferenceDrag_s_m = 0.0175, kReferenceRadius_m = 0.0635, kReferenceHover_rpm = 8950.0;
constexpr double kReferenceSpeed_m_s = 8.5;

double disk_scale(double radius_m, const HoverRotor& h) {
  const double tip_m_s = radius_m * h.omega_rad_s;
  return h.density_kg_m3 * std::numbers::pi * radius_m * radius_m * tip_m_s * tip_m_s;
}

sim::RotorLoads loads(const sim::Rotor& rotor, const HoverRotor& h, double forward_m_s, double climb_m_s) {
  sim::RotorCondition c;
  c.v_R_m_s = {forward_m_s, 0.0, climb_m_s};
  c.omega_rad_s = h.omega_rad_s;
  c.density_kg_m3 = h.density_kg_m3;
  sim::RotorWarmStart cold;
  return sim::solve_rotor(rotor, c, cold);
}

double slope_through_zero(double most_advance, const std::function<double(double)>& drag_coefficient) {
  double xx = 0.0, xy = 0.0;
  for (int k = 1; k * kAdvanceStep < most_advance + 1e-9; ++k) {
    const double mu = k * kAdvanceStep;
    xx += mu * mu;
    xy += mu * drag_coefficient(mu);
  }
  return xy / xx;
}

// A Bebop rotor: the shipped blade at its radius, pitch such that `hover.omega_rad_s` carries the weight; none if no pitch does.
std::optional<sim::Blade> bebop_blade(const sim::Blade& reference, const HoverRotor& hover, double& pitch_ratio) {
  double low = 0.4, high = kMostPitchRatio;
  const auto thrust = [&](double ratio) {
    return loads(sim::Rotor(scaled_blade(reference, kBebopRadius_m, ratio)), hover, 0.0, 0.0).force_R_N.z();
  };
  if (thrust(low) > hover.thrust_N || thrust(high) < hover.thrust_N) return std::nullopt;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (low + high);
    (thrust(middle) < hover.thrust_N ? low : high) = middle;
  }
  pitch_ratio = 0.5 * (low + high);
  return scaled_blade(reference, kBebopRadius_m, pitch_ratio);
}

HoverRotor bebop_hover(double rpm) { return {kBebopMass_kg * kGravity_m_s2 / 4.0, rpm * kRad_s_per_rpm, kDensity_kg_m3}; }

sim::Blade with_chord(sim::Blade blade, double scale) {
  for (sim::BladeStation& s : blade.stations) s.chord_m *= scale;
  return blade;
}

double hover_speed(const sim::Rotor& rotor, double thrust_N) {
  double low = 300.0, high = 2500.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (loads(rotor, {thrust_N, middle, kDensity_kg_m3}, 0.0, 0.0).force_R_N.z() < thrust_N ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// "1", "mu_x", "mu_x*mu_z^2".
CxPolynomial::Term parse_term(const TextFile& file, int line, const std::string& text) {
  CxPolynomial::Term term{0.0, 0, 0};
  if (text == "1") return term;
  std::size_t at = 0;
  while (at <= text.size()) {
    const std::size_t end = std::min(text.find('*', at), text.size());
    const std::string factor = text.substr(at, end - at);
    const bool power = factor.size() == 6 && factor[4] == '^' && factor[5] >= '2' && factor[5] <= '9';
    const std::string name = power ? factor.substr(0, 4) : factor;
    int& exponent = name == "mu_z" ? term.power_z : term.power_x;
    if (name != "mu_x" && name != "mu_z")
      file.fail(line, fmt::format("term \"{}\" has the factor \"{}\"", text, factor), "a misspelt term",
                "write products of mu_x and mu_z with powers 2 to 9, as mu_x*mu_z^2, or 1");
    exponent += power ? factor[5] - '0' : 1;
    at = end + 1;
  }
  return term;
}
}  // namespace

double CxPolynomial::operator()(double mu_x, double mu_z) const {
  double sum = 0.0;
  for (const Term& t : terms) sum += t.theta * std::pow(mu_x, t.power_x) * std::pow(mu_z, t.power_z);
  return sum;
}

CxPolynomial read_cx_polynomial(const TextFile& file) {
  CxPolynomial c;
  bool linear = false;
  for (const TextLine& line : file.lines) {
    if (!line.text.starts_with("Cx,")) continue;
    TextLine row{line.number, line.text, {}};
    for (std::size_t at = 0; at <= line.text.size();) {
      const std::size_t end = std::min(line.text.find(',', at), line.text.size());
      row.fields.push_back(line.text.substr(at, end - at));
      at = end + 1;
    }
    if (row.fields.size() != 5)
      file.fail(line.number, fmt::format("{} fields, expected 5: coefficient, sideslip, term, theta, nrms", row.fields.size()),
                "a damaged row", "correct or remove the row");
    CxPolynomial::Term term = parse_term(file, line.number, row.fields[2]);
    term.theta = file.number(row, 3, "theta", {-1e3, 1e3, "1"});
    linear = linear || (term.power_x == 1 && term.power_z == 0 && term.theta < 0.0);
    c.terms.push_back(term);
  }
  if (!linear)
    file.fail(1, "no row Cx with the term mu_x and a negative theta", "another coefficient's file, or another sign convention",
              "give the polynomial of the force along forward, drag negative");
  return c;
}

double measured_slope(const CxPolynomial& c, double tilt, double most_advance) {
  // Odd part: forward and backward flight. The even terms are an offset, not drag.
  return slope_through_zero(most_advance, [&](double mu) { return 0.5 * (c(-mu, tilt * mu) - c(mu, tilt * mu)); });
}

double isolated_slope(const sim::Blade& blade, const HoverRotor& hover, double tilt, double most_advance) {
  const sim::Rotor rotor(blade);
  const double tip_m_s = blade.radius_m * hover.omega_rad_s, scale = disk_scale(blade.radius_m, hover);
  return slope_through_zero(most_advance, [&](double mu) {
    return -loads(rotor, hover, mu * tip_m_s, -tilt * mu * tip_m_s).force_R_N.x() / scale;  // z down there, up here
  });
}

namespace {

// What is not known of the Bebop and of the reading of its polynomial; pitch is set anew wherever the blade changes.
void vary_assumptions(const CxPolynomial& c, const sim::Blade& reference, const sim::Blade& blade, const HoverRotor& hover,
                      InPlaneForce& r) {
  std::map<std::string, double> largest;
  const auto vary = [&](const std::string& kind, const std::string& what, double k_H) {
    r.variations.push_back({kind + " " + what, k_H});
    largest[kind] = std::max(largest[kind], std::fabs(k_H - r.k_H));
  };
  const auto vary_blade = [&](const std::string& kind, const std::string& what, const sim::Blade& shape, double rpm) {
    double ratio = 0.0;
    const HoverRotor h = bebop_hover(rpm);
    if (const auto varied = bebop_blade(shape, h, ratio))
      vary(kind, what, r.bebop_measured / isolated_slope(*varied, h));
    else
      r.impossible.push_back(kind + " " + what);
  };
  for (const double rpm : {6800.0, 7350.0}) vary_blade("hover speed", fmt::format("{:.0f} rpm", rpm), reference, rpm);
  for (const double chord : {0.8, 0.95, 1.25})
    vary_blade("chord", fmt::format("x {}", chord), with_chord(reference, chord), kBebopHover_rpm);
  for (const double drag : {1.0, 1.7}) {
    sim::Blade b = reference;
    b.drag_scale = drag;
    vary_blade("drag scale", fmt::format("{}", drag), b, kBebopHover_rpm);
  }
  sim::Blade no_delay = reference;
  no_delay.stall_delay = 0.0;
  vary_blade("stall delay", "none", no_delay, kBebopHover_rpm);
  for (const double most : {0.1, 0.3})
    vary("advance ratio", fmt::format("to {}", most), measured_slope(c, 0.0, most) / isolated_slope(blade, hover, 0.0, most));
  const double tilt = -std::tan(20.0 * std::numbers::pi / 180.0);  // flow from above, usual in the paper's forward flight
  vary("angle of attack", "-20 deg", measured_slope(c, tilt) / isolated_slope(blade, hover, tilt));
  double sum = 0.0;
  for (const auto& [kind, shift] : largest) sum += shift * shift;
  r.k_H_u = std::sqrt(sum);
}

void scale_to_reference(const sim::Blade& reference, InPlaneForce& r) {
  const sim::Rotor rotor(reference);
  const double thrust_N = kReferenceMass_kg * kGravity_m_s2 / 4.0;
  r.reference_isolated_N =
      -4.0 * loads(rotor, {thrust_N, hover_speed(rotor, thrust_N), kDensity_kg_m3}, kReferenceSpeed_m_s, 0.0).force_R_N.x();
  r.paper_N = kReferenceDrag_s_m * 4.0 * thrust_N * kReferenceSpeed_m_s;
  const HoverRotor at_paper{thrust_N, kReferenceHover_rpm * kRad_s_per_rpm, kDensity_kg_m3};
  const double mu = kReferenceSpeed_m_s / (kReferenceRadius_m * at_paper.omega_rad_s);
  r.bebop_scaled_N = r.bebop_measured * mu * 4.0 * disk_scale(kReferenceRadius_m, at_paper);
}

}  // namespace

InPlaneForce validate_in_plane_force(const std::filesystem::path& data_folder, const std::filesystem::path& blade_file) {
  const CxPolynomial c =
      read_cx_polynomial(TextFile::read(data_folder / "propellers" / "forward_flight_bebop" / "bebop_graybox_cx_cm.csv"));
  const sim::Blade reference = sim::read_blade(blade_file);
  InPlaneForce r;
  const HoverRotor hover = bebop_hover(kBebopHover_rpm);
  const std::optional<sim::Blade> found = bebop_blade(reference, hover, r.bebop_pitch_ratio);
  if (!found)
    throw Error({blade_file.generic_string(),
                 fmt::format("at no pitch does this blade carry {:.3f} N at {:.0f} rpm with radius {} m", hover.thrust_N, kBebopHover_rpm,
                             kBebopRadius_m),
                 "a blade file with narrower chords", "give the shipped three-blade file"});
  const sim::Blade& blade = *found;
  const double torque_N_m = loads(sim::Rotor(blade), hover, 0.0, 0.0).shaft_torque_N_m;
  r.bebop_figure_of_merit = hover.thrust_N *
                            std::sqrt(hover.thrust_N / (2.0 * kDensity_kg_m3 * std::numbers::pi * kBebopRadius_m * kBebopRadius_m)) /
                            (torque_N_m * hover.omega_rad_s);
  r.bebop_measured = measured_slope(c);
  r.bebop_isolated = isolated_slope(blade, hover);
  r.k_H = r.bebop_measured / r.bebop_isolated;

  vary_assumptions(c, reference, blade, hover, r);
  scale_to_reference(reference, r);
  return r;
}

bool within_limits(const InPlaneForce& r) { return std::fabs(r.k_H * r.reference_isolated_N / r.paper_N - 1.0) <= kInPlaneLimit; }

std::vector<std::string> report_lines(const InPlaneForce& r) {
  std::vector<std::string> lines;
  lines.push_back(fmt::format("Bebop: slope measured {:.5f}, isolated rotors {:.5f} (pitch ratio {:.2f}, figure of merit {:.2f})",
                              r.bebop_measured, r.bebop_isolated, r.bebop_pitch_ratio, r.bebop_figure_of_merit));
  lines.push_back(fmt::format("k_H from the Bebop {:.2f} +- {:.2f}", r.k_H, r.k_H_u));
  for (const Variation& v : r.variations) lines.push_back(fmt::format("  {:28} k_H {:.2f}", v.what, v.k_H));
  for (const std::string& what : r.impossible) lines.push_back(fmt::format("  {:28} cannot carry the weight at this speed", what));
  const auto line = [&](double k_H, const std::string& what) {
    lines.push_back(fmt::format(
        "reference quadrotor at {} m/s, {:24} {:.3f} N, {:+.1f} % of the paper's {:.3f} N, {:+.1f} % of the Bebop's slope {:.3f} N",
        kReferenceSpeed_m_s, what, k_H * r.reference_isolated_N, 100 * (k_H * r.reference_isolated_N / r.paper_N - 1), r.paper_N,
        100 * (k_H * r.reference_isolated_N / r.bebop_scaled_N - 1), r.bebop_scaled_N));
  };
  line(1.0, "k_H 1");
  line(r.k_H, fmt::format("k_H {:.2f} (Bebop)", r.k_H));
  line(r.k_H - r.k_H_u, fmt::format("k_H {:.2f} (lower)", r.k_H - r.k_H_u));
  line(r.k_H + r.k_H_u, fmt::format("k_H {:.2f} (upper)", r.k_H + r.k_H_u));
  return lines;
}

}  // namespace rotorloop::propeller
