#include "bench/propeller/report/rotor_plot.hpp"

#include <fmt/format.h>

#include <cmath>

#include "bench/propeller/report/blade_figures.hpp"
#include "bench/propeller/report/disk_figures.hpp"
#include "bench/propeller/report/performance_figures.hpp"
#include "bench/propeller/rotor_sweep.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "host/base/constants.hpp"
#include "host/base/error.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kGram_per_N = 1000 / kGravity_m_s2;  // of thrust, as motor tables have it
constexpr double kSoundSpeed_m_s = 340.3;             // ISA sea level
constexpr double kIncompressibleMach = 0.6;  // beyond, lift and drag of the polars (Mach 0) are off by more than the model's own error
constexpr sim::RotorResolution kCurves{};    // as in flight
constexpr sim::RotorResolution kMaps{.radial = 48, .azimuth = 96};
constexpr sim::RotorResolution kShape{.radial = 64, .azimuth = 8};  // smooth outlines

std::string condition_html(const sim::Rotor& rotor, const sim::RotorCondition& c) {
  const SweepPoint p = rotor_point(rotor, c);
  sim::RotorCondition still = c;
  still.v_R_m_s.setZero();
  const SweepPoint hover = rotor_point(rotor, still);
  const double tip_m_s = c.omega_rad_s * rotor.radius_m();
  const double mach = (tip_m_s + c.v_R_m_s.head<2>().norm()) / kSoundSpeed_m_s;
  std::string out = render::facts_html({{"rotor speed", fmt::format("{:.0f} RPM", c.omega_rad_s * kRpm_per_rad_s)},
                                        {"turning", c.spin > 0 ? "counter-clockwise" : "clockwise"},
                                        {"climb", render::tick_text(c.v_R_m_s.z(), 2) + " m/s"},
                                        {"edgewise", fmt::format("{:.2f} m/s", c.v_R_m_s.head<2>().norm())},
                                        {"density", fmt::format("{:.3f} kg/m³", c.density_kg_m3)},
                                        {"J", render::tick_text(advance_ratio(c, rotor.radius_m()), 3)},
                                        {"μ", fmt::format("{:.3f}", edgewise_advance_ratio(c, rotor.radius_m()))},
                                        {"highest tip Mach number", fmt::format("{:.2f}", mach)}});
  const auto column = [&](const SweepPoint& q, bool still_air) {
    const auto& l = q.loads;
    const auto& k = q.coefficients;
    const double power_W = l.shaft_torque_N_m * c.omega_rad_s;
    const bool lifting = l.force_R_N.z() > 0 && power_W > 0;
    return std::vector<std::string>{render::tick_text(l.force_R_N.z(), 3) + " N",
                                    render::tick_text(l.force_R_N.head<2>().norm(), 3) + " N",
                                    render::tick_text(1e3 * l.shaft_torque_N_m, 2) + " mN m",
                                    render::tick_text(power_W, 2) + " W",
                                    lifting ? render::tick_text(kGram_per_N * l.force_R_N.z() / power_W, 2) + " g/W" : "",
                                    render::tick_text(l.induced_m_s, 2) + " m/s",
                                    render::tick_text(k.c_t, 4),
                                    render::tick_text(k.c_p, 4),
                                    render::tick_text(k.c_h, 4),
                                    still_air && lifting ? render::tick_text(figure_of_merit(l, q.condition, rotor.radius_m()), 3) : "",
                                    status_name(l.status)};
  };
  constexpr std::array kRows{
      "thrust", "in-plane force",  "shaft torque", "shaft power", "thrust per power", "mean induced velocity", "C_T", "C_P",
      "C_H",    "figure of merit", "status"};
  const auto still_air = column(hover, true), moving = column(p, false);
  out +=
      "<div class=\"scroll\"><table><thead><tr><th class=\"l\"></th><th>in still air</th><th>at this condition</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < kRows.size(); ++i)
    out += fmt::format("<tr><td class=\"l\">{}</td><td>{}</td><td>{}</td></tr>\n", kRows[i], still_air[i], moving[i]);
  out += "</tbody></table></div>\n";
  std::vector<std::string> warnings;
  if (p.loads.status == sim::InflowStatus::not_converged || hover.loads.status == sim::InflowStatus::not_converged)
    warnings.push_back("The solve did not converge: loads of this condition are its best iterate.");
  if (mach > kIncompressibleMach)
    warnings.push_back(
        fmt::format("The highest tip Mach number is {:.2f}. The polars hold for low Mach numbers: above {} thrust and power "
                    "are not to be trusted.",
                    mach, kIncompressibleMach));
  if (warnings.empty()) return out;
  out += "<ul class=\"warn\">";
  for (const auto& w : warnings) out += "<li>" + render::xml_escaped(w) + "</li>";
  return out + "</ul>\n";
}

std::string conventions_html() {
  return R"(<div class="scroll"><table><thead><tr><th class="l">symbol</th><th class="l">definition</th><th class="l">meaning</th></tr></thead><tbody>
<tr><td class="l">n, D, R</td><td class="l">n = RPM / 60, D = 2 R</td><td class="l">revolutions per second; diameter; tip radius</td></tr>
<tr><td class="l">J</td><td class="l">V / (n D) = π V / (ω R)</td><td class="l">advance ratio of the speed V along the shaft, climb positive</td></tr>
<tr><td class="l">μ</td><td class="l">V / (ω R) = V / (π n D)</td><td class="l">advance ratio of the speed V in the disk plane; for one and the same V, J = π μ</td></tr>
<tr><td class="l">C_T, C_H</td><td class="l">force / (ρ n² D⁴)</td><td class="l">thrust along the shaft; in-plane force against the motion</td></tr>
<tr><td class="l">C_P</td><td class="l">power / (ρ n³ D⁵)</td><td class="l">shaft power; C_P = 2 π times the coefficient of torque</td></tr>
<tr><td class="l">C_pitch, C_roll</td><td class="l">moment / (ρ n² D⁵)</td><td class="l">on the hub, in axes along the edgewise motion</td></tr>
<tr><td class="l">η</td><td class="l">J C_T / C_P</td><td class="l">propulsive efficiency; only where thrust and power are positive</td></tr>
<tr><td class="l">figure of merit</td><td class="l">T √(T / (2 ρ π R²)) / power</td><td class="l">ideal over true power in hover</td></tr>
<tr><td class="l">solidity</td><td class="l">blade area / (π R²)</td><td class="l">blades from hub to tip</td></tr>
</tbody></table></div>
<p class="cap">Helicopter books divide by ρ A (ω R)² instead: their C_T is 4 / π³ = 0.129 times this one, their C_P 4 / π⁴ = 0.0411 times.</p>
<p class="cap">Loads are means over a revolution of rigid blades in steady flow: no flapping, no lag of the inflow, no stall hysteresis. Units are SI; pitch
and diameter also in inches because propellers are sold by them; 1 g of thrust is 9.80665 mN.</p>
)";
}

}  // namespace

std::string rotor_plot_html(const sim::Blade& blade, const RotorPlotRequest& request) {
  const sim::RotorCondition& c = request.condition;
  const sim::Rotor rotor(blade, kCurves), shape(blade, kShape);
  if (rotor_point(rotor, c).loads.status == sim::InflowStatus::stopped)
    throw Error({"rotor",
                 fmt::format("{:.0f} RPM is {:.2f} m/s at the tip, less than the 1 m/s at which the inflow means something",
                             c.omega_rad_s * kRpm_per_rad_s, c.omega_rad_s * rotor.radius_m()),
                 "", "give a higher speed with --rpm"});
  std::string out =
      render::page_begin(request.title, "a rotor as the blade-element-momentum solve sees it: computed, not measured", "rotor");
  out +=
      "<nav><a href=\"#blade\">Blade</a><a href=\"#climb\">Climb</a><a href=\"#edgewise\">Edgewise flow</a><a "
      "href=\"#descent\">Descent</a><a "
      "href=\"#disk\">Disk</a><a href=\"#conventions\">Conventions</a></nav>\n";
  out += "<h2 id=\"condition\">Operating point</h2>\n" + condition_html(rotor, c);
  out += "<h2 id=\"blade\">Blade</h2>\n" + blade_section_html(blade, shape);
  out += "<h2 id=\"climb\">Climb</h2>\n" + advance_section_html(rotor, c);
  out += "<h2 id=\"edgewise\">Edgewise flow</h2>\n" + edgewise_section_html(rotor, c);
  out += "<h2 id=\"descent\">Descent</h2>\n" + descent_section_html(rotor, c);
  out += "<h2 id=\"disk\">Disk</h2>\n" + disk_section_html(sim::Rotor(blade, kMaps), c);
  out += "<h2 id=\"conventions\">Conventions and units</h2>\n" + conventions_html();
  out += "<h2 id=\"provenance\">Provenance</h2>\n" +
         render::facts_html({{"blade file", request.source},
                             {"made by", request.version},
                             {"solve, curves", fmt::format("{} annuli × {} azimuths", kCurves.radial, kCurves.azimuth)},
                             {"solve, disk maps", fmt::format("{} annuli × {} azimuths", kMaps.radial, kMaps.azimuth)}});
  return out + render::page_end();
}

}  // namespace rotorloop::propeller
