#include "bench/propeller/report/blade_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kInch_m = 0.0254;
constexpr double kQuarter = 0.25;  // of the chord, from the leading edge: the line that is drawn straight
constexpr double kPolarFrom_deg = -20, kPolarTo_deg = 40;

double twist_deg(const sim::Annulus& a) { return std::atan2(a.sin_twist, a.cos_twist) / kRad_per_deg; }

const sim::Annulus& annulus_at(const sim::Rotor& rotor, double share_of_radius) {
  const double r_m = share_of_radius * rotor.radius_m();
  return *std::min_element(rotor.annuli().begin(), rotor.annuli().end(),
                           [&](const auto& a, const auto& b) { return std::fabs(a.r_m - r_m) < std::fabs(b.r_m - r_m); });
}

double pitch_m(double r_m, double twist) { return 2 * std::numbers::pi * r_m * std::tan(twist * kRad_per_deg); }

std::string planform_svg(const sim::Rotor& rotor) {
  render::Plot p;
  p.title = "plan form of one blade, to scale";
  p.x_label = "radius, mm";
  p.y_label = "mm";
  p.equal_axes = true;
  render::Series outline{.label = "", .x = {}, .y = {}, .colour = 1, .width_px = 2};
  const auto& annuli = rotor.annuli();
  double widest_mm = 0;
  for (const auto& a : annuli) {
    outline.x.push_back(1e3 * a.r_m);
    outline.y.push_back(1e3 * kQuarter * a.chord_m);
    widest_mm = std::max(widest_mm, 1e3 * a.chord_m);
  }
  for (auto a = annuli.rbegin(); a != annuli.rend(); ++a) {
    outline.x.push_back(1e3 * a->r_m);
    outline.y.push_back(-1e3 * (1 - kQuarter) * a->chord_m);
  }
  outline.x.push_back(outline.x.front());
  outline.y.push_back(outline.y.front());
  const double radius_mm = 1e3 * rotor.radius_m(), hub_mm = 1e3 * rotor.hub_radius_m();
  p.height_px = std::clamp(static_cast<int>(1000 * 1.2 * widest_mm / radius_mm) + 60, 160, 600);
  p.series = {
      outline,
      {.label = "quarter-chord line", .x = {hub_mm, radius_mm}, .y = {0, 0}, .colour = render::kNeutral, .dashed = true, .width_px = 1},
      {.label = "hub", .x = {0, hub_mm}, .y = {0, 0}, .colour = render::kNeutral, .width_px = 3}};
  return render::plot_svg(p);
}

std::string twist_svg(const sim::Rotor& rotor) {
  render::Plot p;
  p.title = "twist along the radius";
  p.x_label = "radius / tip radius";
  p.y_label = "twist, degrees";
  p.width_px = 500;
  p.height_px = 280;
  p.x_min = 0;
  p.x_max = 1;
  p.y_from_zero = true;
  const double pitch_at_75_m = pitch_m(0.75 * rotor.radius_m(), twist_deg(annulus_at(rotor, 0.75)));
  render::Series blade{.label = "this blade", .x = {}, .y = {}, .colour = 1, .width_px = 2};
  render::Series helix{
      .label = "helix of the pitch at 0.75 R", .x = {}, .y = {}, .colour = render::kNeutral, .dashed = true, .width_px = 1.2};
  for (const auto& a : rotor.annuli()) {
    const double share = a.r_m / rotor.radius_m();
    blade.x.push_back(share);
    blade.y.push_back(twist_deg(a));
    if (share < 0.25) continue;  // the helix shoots up towards the hub
    helix.x.push_back(share);
    helix.y.push_back(std::atan(pitch_at_75_m / (2 * std::numbers::pi * a.r_m)) / kRad_per_deg);
  }
  p.series = {blade, helix};
  return render::plot_svg(p);
}

std::string sections_svg(const sim::Rotor& rotor) {
  render::Plot p;
  p.title = "chord lines at true length and angle";
  p.x_label = "mm, towards the leading edge";
  p.y_label = "mm, along the thrust";
  p.width_px = 500;
  p.height_px = 280;
  p.equal_axes = true;
  int colour = 0;
  for (const double share : {0.25, 0.5, 0.75, 0.95}) {
    const auto& a = annulus_at(rotor, share);
    const double lead = 1e3 * kQuarter * a.chord_m, trail = -1e3 * (1 - kQuarter) * a.chord_m;
    p.series.push_back({.label = fmt::format("{:.2f} R", a.r_m / rotor.radius_m()),
                        .x = {trail * a.cos_twist, lead * a.cos_twist},
                        .y = {trail * a.sin_twist, lead * a.sin_twist},
                        .colour = colour++,
                        .width_px = 3});
  }
  return render::plot_svg(p);
}

// Lift and drag of the polar at lowest, middle and highest Reynolds number.
std::string polar_figures(const std::string& name, const sim::Polar& polar) {
  render::Plot lift, drag;
  lift.title = name + ": lift coefficient";
  lift.y_label = "lift coefficient";
  drag.title = name + ": drag coefficient";
  drag.y_label = "drag coefficient";
  const std::size_t last = polar.tables.size() - 1;
  std::vector<std::size_t> shown{0};
  for (const std::size_t i : {last / 2, last})
    if (i != shown.back()) shown.push_back(i);
  for (render::Plot* p : {&lift, &drag}) {
    p->x_label = "angle of attack, degrees";
    p->width_px = 500;
    p->height_px = 240;
    p->x_min = kPolarFrom_deg;
    p->x_max = kPolarTo_deg;
    int colour = 0;
    for (const std::size_t i : shown)
      p->series.push_back({.label = fmt::format("Re {:.0f}k", polar.tables[i].reynolds / 1000),
                           .x = polar.alpha_deg,
                           .y = p == &lift ? polar.tables[i].cl : polar.tables[i].cd,
                           .colour = colour++});
  }
  return "<div class=\"two\">\n" + render::figure_html("<b>" + render::xml_escaped(name) + "</b>: lift", render::plot_svg(lift)) +
         render::figure_html("<b>" + render::xml_escaped(name) + "</b>: drag", render::plot_svg(drag)) + "</div>\n";
}

std::string stations_table(const sim::Blade& b) {
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th>radius, mm</th><th>r / R</th><th>chord, mm</th><th>c / R</th><th>twist, deg</th>"
      "<th>pitch, in</th><th class=\"l\">polar</th></tr></thead><tbody>\n";
  for (const auto& s : b.stations)
    out += fmt::format(
        "<tr><td>{:.2f}</td><td>{:.3f}</td><td>{:.2f}</td><td>{:.3f}</td><td>{:.1f}</td><td>{:.2f}</td><td class=\"l\">{}</td></tr>\n",
        1e3 * s.r_m, s.r_m / b.radius_m, 1e3 * s.chord_m, s.chord_m / b.radius_m, s.twist_deg, pitch_m(s.r_m, s.twist_deg) / kInch_m,
        render::xml_escaped(s.polar));
  return out + "</tbody></table></div>\n";
}

std::string polars_table(const sim::Blade& b) {
  std::string out =
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\">polar</th><th>tables</th><th>Reynolds numbers</th><th "
      "class=\"l\">source</th>"
      "</tr></thead><tbody>\n";
  for (const auto& [name, polar] : b.polars)
    out += fmt::format("<tr><td class=\"l\">{}</td><td>{}</td><td>{:.0f}k … {:.0f}k</td><td class=\"l\">{}</td></tr>\n",
                       render::xml_escaped(name), polar.tables.size(), polar.tables.front().reynolds / 1000,
                       polar.tables.back().reynolds / 1000, render::xml_escaped(polar.source));
  return out + "</tbody></table></div>\n";
}

}  // namespace

double blade_solidity(const sim::Rotor& rotor) {
  double area_m2 = 0;
  for (const auto& a : rotor.annuli()) area_m2 += rotor.blades() * a.chord_m * a.weight_m;
  return area_m2 / (std::numbers::pi * rotor.radius_m() * rotor.radius_m());
}

std::string blade_section_html(const sim::Blade& blade, const sim::Rotor& rotor) {
  const auto& at_75 = annulus_at(rotor, 0.75);
  std::string out = render::facts_html({{"blades", fmt::format("{}", blade.blades)},
                                        {"radius", fmt::format("{:.2f} mm", 1e3 * blade.radius_m)},
                                        {"diameter", fmt::format("{:.2f} in", 2 * blade.radius_m / kInch_m)},
                                        {"hub radius", fmt::format("{:.2f} mm", 1e3 * blade.hub_radius_m)},
                                        {"pitch at 0.75 R", fmt::format("{:.2f} in", pitch_m(at_75.r_m, twist_deg(at_75)) / kInch_m)},
                                        {"chord at 0.75 R", fmt::format("{:.2f} mm", 1e3 * at_75.chord_m)},
                                        {"solidity", fmt::format("{:.3f}", blade_solidity(rotor))},
                                        {"inertia of all blades", fmt::format("{:.2g} kg m²", blade.blade_inertia_kg_m2)},
                                        {"stall delay", fmt::format("{:.2g} (c/r)²", blade.stall_delay)},
                                        {"its drag", fmt::format("{:.2g}", blade.stall_drag)},
                                        {"drag scale", fmt::format("{:.2f}", blade.drag_scale)},
                                        {"lift scale", fmt::format("{:.2f}", blade.lift_scale)},
                                        {"pitch offset (in the twist)", fmt::format("{:.2f}°", blade.pitch_offset_deg)}});
  out += render::figure_html(
      "<b>Plan form</b> of one blade, to scale, seen from above; leading edge up. The file gives no sweep: the quarter-chord "
      "line is drawn straight.",
      planform_svg(rotor));
  out += "<div class=\"two\">\n" + render::figure_html("<b>Twist</b>: chord line against the rotor plane", twist_svg(rotor)) +
         render::figure_html("<b>Chord lines</b> at true length and angle, seen from the tip", sections_svg(rotor)) + "</div>\n";
  out += "<h3>Stations of the file</h3>\n" + stations_table(blade) + "<h3>Polars</h3>\n" + polars_table(blade);
  out +=
      "<p class=\"cap\">As the files give them; the solve multiplies the drag by the drag scale and delays the stall of inner sections. "
      "Reynolds numbers outside the tables use the nearest table.</p>\n";
  for (const auto& [name, polar] : blade.polars) out += polar_figures(name, polar);
  return out;
}

}  // namespace rotorloop::propeller
