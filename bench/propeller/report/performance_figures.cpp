#include "bench/propeller/report/performance_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/propeller/rotor_sweep.hpp"
#include "bench/render/page.hpp"
#include "bench/render/svg_plot.hpp"
#include "host/base/constants.hpp"

namespace rotorloop::propeller {
namespace {

constexpr double kMuMost = 0.4;  // a 5 inch rotor in hover speed at 24 m/s
constexpr std::array kClimbAngles_deg{-15.0, 0.0, 15.0, 30.0};
constexpr double kDescent = -4.0, kClimb = 2.0;  // range of the descent figures, in induced velocities of hover

using Points = std::vector<SweepPoint>;

template <class X, class Y>
render::Series series_of(const Points& points, std::string label, int colour, X x, Y y) {
  render::Series s{.label = std::move(label), .x = {}, .y = {}, .colour = colour};
  for (const auto& p : points) {
    s.x.push_back(x(p));
    s.y.push_back(y(p));
  }
  return s;
}

render::Plot small_plot(std::string title, std::string x_label, std::string y_label) {
  render::Plot p;
  p.title = std::move(title);
  p.x_label = std::move(x_label);
  p.y_label = std::move(y_label);
  p.width_px = 340;  // three in a row
  p.height_px = 260;
  return p;
}

struct Figure {
  const char *caption, *y_label;
  double RotorCoefficients::*value;
};

// One plot for each coefficient, the same curves in each.
template <std::size_t kCount, class X>
std::string coefficient_plots(const std::array<Figure, kCount>& figures, const std::vector<std::pair<std::string, Points>>& curves,
                              const char* x_label, X x) {
  std::string out = "<div class=\"views\">\n";
  for (const auto& f : figures) {
    render::Plot p = small_plot(f.caption, x_label, f.y_label);
    p.y_from_zero = true;
    int colour = 0;
    for (const auto& [label, points] : curves)
      p.series.push_back(series_of(points, label, colour++, x, [&](const SweepPoint& q) { return q.coefficients.*f.value; }));
    out += render::figure_html("<b>" + std::string(f.caption) + "</b>", render::plot_svg(p));
  }
  return out + "</div>\n";
}

// Intervals of one status, their borders midway between points.
std::vector<render::Band> status_bands(const Points& points) {
  constexpr std::array kColours{2, 4, 0, render::kNeutral, 3};  // by InflowStatus
  std::vector<render::Band> bands;
  const auto speed = [&](std::size_t i) { return points[i].condition.v_R_m_s.z(); };
  for (std::size_t i = 0; i < points.size();) {
    std::size_t end = i + 1;
    while (end < points.size() && points[end].loads.status == points[i].loads.status) ++end;
    bands.push_back({i == 0 ? speed(0) : (speed(i - 1) + speed(i)) / 2,
                     end == points.size() ? speed(end - 1) : (speed(end - 1) + speed(end)) / 2, status_name(points[i].loads.status),
                     kColours[static_cast<std::size_t>(points[i].loads.status)]});
    i = end;
  }
  return bands;
}

// Where a rotor that sinks and one that climbs have different loads at the same speed; empty where none.
std::string two_balances(const Points& sinking, const Points& rising) {
  constexpr double kVisible_m_s = 0.01;
  double low = HUGE_VAL, high = -HUGE_VAL, most_m_s = 0;
  for (std::size_t i = 0; i < sinking.size(); ++i) {
    const double apart_m_s = std::fabs(sinking[i].loads.induced_m_s - rising[i].loads.induced_m_s);
    if (apart_m_s < kVisible_m_s) continue;
    const double climb_m_s = sinking[i].condition.v_R_m_s.z();
    low = std::min(low, climb_m_s);
    high = std::max(high, climb_m_s);
    most_m_s = std::max(most_m_s, apart_m_s);
  }
  if (!(low <= high)) return "";
  return fmt::format(
      " Between {} and {} m/s stalled annuli have more than one balance: each point starts from the one before, as in flight, and the "
      "mean induced velocity differs by up to {:.2f} m/s with the direction that the speed is reached from.",
      render::tick_text(low, 1), render::tick_text(high, 1), most_m_s);
}

}  // namespace

std::string status_name(sim::InflowStatus status) {
  switch (status) {
    case sim::InflowStatus::converged:
      return "normal working state";
    case sim::InflowStatus::windmill:
      return "windmill";
    case sim::InflowStatus::vortex_ring:
      return "vortex ring";
    case sim::InflowStatus::stopped:
      return "stopped";
    case sim::InflowStatus::not_converged:
      return "not converged";
  }
  return "unknown";
}

std::string advance_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition) {
  std::vector<std::pair<std::string, Points>> curves;
  for (const double share : {0.5, 1.0, 2.0}) {
    sim::RotorCondition c = condition;
    c.omega_rad_s *= share;
    curves.emplace_back(fmt::format("{:.0f} RPM", c.omega_rad_s * kRpm_per_rad_s), advance_sweep(rotor, c));
  }
  constexpr std::array<Figure, 3> kFigures{{{"Thrust coefficient", "C_T", &RotorCoefficients::c_t},
                                            {"Power coefficient", "C_P", &RotorCoefficients::c_p},
                                            {"Propulsive efficiency", "η", &RotorCoefficients::eta}}};
  return "<p class=\"cap\">Air along the shaft, from hover to the first point without thrust, at half, once and twice the speed asked for. "
         "Were there no effect of Reynolds number, the curves would lie on each other; that of the tip's Mach number is not "
         "modelled.</p>\n" +
         coefficient_plots(kFigures, curves, "advance ratio J",
                           [&](const SweepPoint& p) { return advance_ratio(p.condition, rotor.radius_m()); });
}

std::string edgewise_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition) {
  std::vector<std::pair<std::string, Points>> curves;
  for (const double angle_deg : kClimbAngles_deg)
    curves.emplace_back(fmt::format("{}{:.0f}°", angle_deg < 0 ? "−" : "", std::fabs(angle_deg)),
                        edgewise_sweep(rotor, condition, angle_deg * std::numbers::pi / 180, kMuMost));
  constexpr std::array<Figure, 5> kFigures{{{"Thrust coefficient", "C_T", &RotorCoefficients::c_t},
                                            {"Power coefficient", "C_P", &RotorCoefficients::c_p},
                                            {"In-plane force against motion", "C_H", &RotorCoefficients::c_h},
                                            {"Pitching moment (+: upstream edge down)", "C_pitch", &RotorCoefficients::c_pitch},
                                            {"Rolling moment (+: left edge up)", "C_roll", &RotorCoefficients::c_roll}}};
  return fmt::format(
             "<p class=\"cap\">Curves by climb angle: how far the rotor's motion through the air points above the disk plane. A "
             "multirotor that leans forward by 15° in level flight meets the air at a climb angle of 15°. {:.0f} RPM, turning {} "
             "seen from above; turning the other way, the rolling moment changes its sign. Blades are rigid: a flapping blade "
             "would hand less moment to the hub.</p>\n",
             condition.omega_rad_s * kRpm_per_rad_s, condition.spin > 0 ? "counter-clockwise" : "clockwise") +
         coefficient_plots(kFigures, curves, "edgewise advance ratio μ",
                           [&](const SweepPoint& p) { return edgewise_advance_ratio(p.condition, rotor.radius_m()); });
}

std::string descent_section_html(const sim::Rotor& rotor, const sim::RotorCondition& condition) {
  sim::RotorCondition hover = condition;
  hover.v_R_m_s.setZero();
  const double area_m2 = std::numbers::pi * rotor.radius_m() * rotor.radius_m();
  const double hover_thrust_N = rotor_point(rotor, hover).loads.force_R_N.z();
  const double hover_m_s = std::sqrt(std::max(hover_thrust_N, 1e-6) / (2 * condition.density_kg_m3 * area_m2));
  const double lowest_m_s = kDescent * hover_m_s, highest_m_s = kClimb * hover_m_s;
  const Points rising = climb_sweep(rotor, condition, lowest_m_s, highest_m_s);
  Points sinking = climb_sweep(rotor, condition, highest_m_s, lowest_m_s);
  std::reverse(sinking.begin(), sinking.end());
  const auto climb = [](const SweepPoint& p) { return p.condition.v_R_m_s.z(); };
  const auto induced = [](const SweepPoint& p) { return p.loads.induced_m_s; };
  const auto descent_plot = [&](const char* title, const char* y_label, auto y) {
    render::Plot p;
    p.title = title;
    p.x_label = "climb speed, m/s (descent < 0)";
    p.y_label = y_label;
    p.y_from_zero = true;
    p.bands = status_bands(sinking);
    p.series = {series_of(rising, "climbing out of the windmill", 3, climb, y), series_of(sinking, "sinking from climb", 1, climb, y)};
    return p;
  };
  const render::Plot thrust = descent_plot("thrust in climb and descent", "thrust, N", [](const auto& p) { return p.loads.force_R_N.z(); });
  render::Plot inflow = descent_plot("induced velocity in climb and descent", "induced velocity, m/s", induced);
  inflow.series.push_back(series_of(sinking, "momentum theory at the same thrust", render::kNeutral, climb, [&](const auto& p) {
    return momentum_theory_induced_m_s(p.loads.force_R_N.z(), climb(p), condition.density_kg_m3, area_m2);
  }));
  inflow.series.back().dashed = true;
  const render::Plot power = descent_plot("shaft power in climb and descent", "shaft power, W",
                                          [](const auto& p) { return p.loads.shaft_torque_N_m * p.condition.omega_rad_s; });
  return fmt::format(
             "<p class=\"cap\">Air along the shaft at {:.0f} RPM. Shading is the status that the solve reports. Vortex ring: momentum "
             "theory "
             "does not hold; the inflow is an empirical mean of measurements, while a real rotor shakes. Windmill: the air flows up "
             "through "
             "the disk and is slowed; the shaft may still need power, for the drag of stalled blades.{}</p>\n<p class=\"cap\">By momentum "
             "theory hover induces {:.2f} m/s. The mean of the solve is larger: it is the speed at the blades, higher towards tip and "
             "root.</p>\n",
             condition.omega_rad_s * kRpm_per_rad_s, two_balances(sinking, rising), hover_m_s) +
         render::figure_html("<b>Thrust</b>", render::plot_svg(thrust)) +
         render::figure_html("<b>Induced velocity</b>, positive downwards", render::plot_svg(inflow)) +
         render::figure_html("<b>Shaft power</b>; below zero the air drives the rotor", render::plot_svg(power));
}

}  // namespace rotorloop::propeller
