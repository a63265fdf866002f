#include "bench/propeller/report/disk_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/render/page.hpp"
#include "bench/render/svg_pieces.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kTrimmedArea = 0.02;  // of the map of inflow, at either end of its scale
// Reversed flow at the hub would take the whole scale of the angle of attack: what lies beyond stall is one colour.
constexpr double kAlphaLow_deg = -10, kAlphaHigh_deg = 25;

// Edges between the rings of the quadrature: each ring has the area that its node stands for.
std::vector<double> ring_edges(const sim::Rotor& rotor) {
  std::vector<double> edges{rotor.hub_radius_m()};
  for (const auto& a : rotor.annuli()) edges.push_back(std::sqrt(edges.back() * edges.back() + 2 * a.r_m * a.weight_m));
  edges.back() = rotor.radius_m();
  return edges;
}

// Ends of a scale that leave the share `outside` of the area beyond each of them: the loss at the tip makes the induced velocity there
// many times that of the rest, and would take the scale.
void trim_scale(render::DiskMap& m, const sim::RotorDisk& disk, DiskQuantity quantity, double outside) {
  std::vector<std::pair<double, double>> by_value;
  double area_m2 = 0;
  for (const auto& cell : disk.cells) {
    by_value.emplace_back(quantity(cell), cell.area_m2);
    area_m2 += cell.area_m2;
  }
  std::sort(by_value.begin(), by_value.end());
  double below_m2 = 0;
  for (const auto& [value, cell_m2] : by_value) {
    if (below_m2 <= outside * area_m2) m.low = value;
    if (below_m2 <= (1 - outside) * area_m2) m.high = value;
    below_m2 += cell_m2;
  }
}

}  // namespace

render::DiskMap disk_map_of(const sim::Rotor& rotor, const sim::RotorCondition& condition, const sim::RotorDisk& disk,
                            DiskQuantity quantity, const std::string& label) {
  render::DiskMap m;
  m.title = label + " over the disk";
  m.label = label;
  m.ring_edges_m = ring_edges(rotor);
  m.sectors = disk.azimuth;
  m.values.assign(disk.cells.size(), std::nan(""));
  const double wide = 2 * std::numbers::pi / std::max(1, disk.azimuth);
  for (int i = 0; i < disk.radial; ++i)
    for (int k = 0; k < disk.azimuth; ++k) {
      const sim::DiskCell& cell = disk.at(i, k);
      const int sector = std::min(disk.azimuth - 1, static_cast<int>(cell.psi_rad / wide));  // cells come in the order of the blades
      m.values[static_cast<std::size_t>(i * disk.azimuth + sector)] = quantity(cell);
    }
  m.spin = condition.spin;
  const double edgewise_m_s = condition.v_R_m_s.head<2>().norm();
  if (edgewise_m_s > 0) {
    m.wind_from_rad = std::atan2(condition.v_R_m_s.y(), condition.v_R_m_s.x());
    m.wind_label = fmt::format("{:.1f} m/s", edgewise_m_s);
  }
  return m;
}

std::string disk_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition) {
  const sim::RotorDisk disk = sim::solve_rotor_disk(rotor, condition);
  if (disk.cells.empty()) return "<p>The solve did not converge at this condition: there is no disk to draw.</p>\n";
  const auto map = [&](const char* label, DiskQuantity quantity) { return disk_map_of(rotor, condition, disk, quantity, label); };
  render::DiskMap alpha = map("angle of attack, degrees", [](const sim::DiskCell& c) { return c.alpha_rad * kDeg_per_rad; });
  const auto [least, most] = std::minmax_element(alpha.values.begin(), alpha.values.end());
  alpha.low = std::max(*least, kAlphaLow_deg);
  alpha.high = std::min(*most, kAlphaHigh_deg);
  if (!(*alpha.low < *alpha.high)) {
    alpha.low = kAlphaLow_deg;
    alpha.high = kAlphaHigh_deg;
  }
  const DiskQuantity through_m_s = [](const sim::DiskCell& c) { return c.through_m_s; };
  render::DiskMap through = map("speed through the disk, m/s", through_m_s);
  trim_scale(through, disk, through_m_s, kTrimmedArea);
  const double v = condition.v_R_m_s.head<2>().norm();
  return fmt::format(
             "<p class=\"cap\">Seen from above, forward is up; {:.0f} RPM, climb {} m/s, edgewise {:.1f} m/s. {}White lines mark a "
             "change of sign; an arrow at the end of a bar, that values lie beyond. Means over all blades that pass a place.</p>\n",
             condition.omega_rad_s * kRpm_per_rad_s, render::tick_text(condition.v_R_m_s.z(), 1), v,
             v > 0 ? fmt::format("The blade advances against the wind on the {}. ", condition.spin > 0 ? "right" : "left") : "") +
         "<div class=\"two\">\n" +
         render::figure_html("<b>Thrust per area</b>",
                             render::disk_map_svg(map("thrust per area, N/m²", [](const sim::DiskCell& c) { return c.thrust_N_per_m2; }))) +
         render::figure_html("<b>Angle of attack</b> of the blade section", render::disk_map_svg(alpha)) +
         render::figure_html("<b>Air through the disk</b>, positive downwards: climb and induced velocity", render::disk_map_svg(through)) +
         render::figure_html(
             "<b>Reynolds number</b> of the chord",
             render::disk_map_svg(map("Reynolds number, thousands", [](const sim::DiskCell& c) { return c.reynolds / 1000; }))) +
         "</div>\n";
}

}  // namespace rotorloop::propeller
