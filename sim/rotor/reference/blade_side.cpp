// One element seen by the air: velocities, angle of attack, forces. Everything is written per azimuth, without symmetry.
#include "sim/rotor/reference/blade_side.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"

namespace rotorloop::sim::reference {
namespace {
constexpr double kPittPeters = 15.0 * std::numbers::pi / 32.0;  // Pitt & Peters 1981, for tan(chi/2)

// Gain of the inflow's tilt towards downstream over the disk, chi the angle of the wake from the shaft.
double skew_gain(const Wind& wind, double induced_m_s) {
  const double through = wind.climb_m_s + induced_m_s;
  const double along = std::sqrt(wind.edgewise_m_s * wind.edgewise_m_s + through * through) + std::fabs(through);
  return along > 0.0 ? kPittPeters * wind.edgewise_m_s / along : 0.0;
}
}  // namespace

Wind wind_of(const RotorCondition& c) {
  Wind w{};
  w.mirror = c.spin >= 0 ? 1.0 : -1.0;
  w.omega_rad_s = c.omega_rad_s + w.mirror * c.w_R_rad_s.z();
  w.climb_m_s = c.v_R_m_s.z();
  w.hub_m_s = {c.v_R_m_s.x(), w.mirror * c.v_R_m_s.y()};
  w.rate_rad_s = {w.mirror * c.w_R_rad_s.x(), c.w_R_rad_s.y()};
  w.edgewise_m_s = w.hub_m_s.norm();
  w.edge_direction = w.edgewise_m_s > 0.0 ? Eigen::Vector2d(w.hub_m_s / w.edgewise_m_s) : Eigen::Vector2d(0.0, 0.0);
  w.density_kg_m3 = c.density_kg_m3;
  return w;
}

StripLoads BladeSide::strip(const ReferenceElement& e, const Wind& wind, double induced_m_s, double swirl_m_s) const {
  StripLoads sum;
  const double skew = conventions.skew ? skew_gain(wind, induced_m_s) * e.r_m / geometry.radius_m : 0.0;
  for (int k = 0; k < azimuths; ++k) {
    const SinCos psi = sincos_exact(2.0 * std::numbers::pi * (k + 0.5) / azimuths);
    const Eigen::Vector2d outward(psi.cos, psi.sin), forward(-psi.sin, psi.cos);  // along the blade; the way it moves
    const double tangential = wind.omega_rad_s * e.r_m - swirl_m_s + wind.hub_m_s.dot(forward);
    const double spanwise = wind.hub_m_s.dot(outward);
    const double upward_of_blade = e.r_m * (wind.rate_rad_s.x() * psi.sin - wind.rate_rad_s.y() * psi.cos);
    const double axial = wind.climb_m_s + induced_m_s * (1.0 - skew * wind.edge_direction.dot(outward)) + upward_of_blade;
    const double speed = std::sqrt(tangential * tangential + axial * axial);
    double alpha = e.twist_rad - atan2_exact(axial, tangential);
    if (alpha > std::numbers::pi) alpha -= 2.0 * std::numbers::pi;
    if (alpha < -std::numbers::pi) alpha += 2.0 * std::numbers::pi;
    const double reynolds = wind.density_kg_m3 * speed * e.chord_m / conventions.viscosity_Pa_s;
    const double mach = conventions.compressibility ? std::min(speed / conventions.sound_speed_m_s, 0.95) : 0.0;
    const SectionCoefficients c = e.section({alpha, reynolds, mach});

    const double area_rho2 = 0.5 * wind.density_kg_m3 * e.chord_m * e.width_m * geometry.blades / azimuths;
    const double up = area_rho2 * speed * (c.cl * tangential - c.cd * axial);
    const double against = area_rho2 * speed * (c.cl * axial + c.cd * tangential);
    const double along = conventions.spanwise_drag ? area_rho2 * speed * c.cd * spanwise : 0.0;
    sum.thrust_N += up;
    sum.torque_N_m += against * e.r_m;
    sum.in_plane_N -= against * forward + along * outward;
    sum.moment_N_m += e.r_m * up * Eigen::Vector2d(psi.sin, -psi.cos);
    sum.mean.axial_m_s += axial / azimuths;
    sum.mean.tangential_m_s += tangential / azimuths;
    sum.mean.cl += c.cl / azimuths;
    sum.mean.cd += c.cd / azimuths;
    sum.mean.reynolds += reynolds / azimuths;
    sum.mean.mach += speed / conventions.sound_speed_m_s / azimuths;
  }
  sum.mean.r_m = e.r_m;
  sum.mean.induced_m_s = induced_m_s;
  sum.mean.thrust_N = sum.thrust_N;
  return sum;
}

ReferenceSolution sum(const ReferenceGeometry& geometry, const RotorConventions& conventions, const Wind& wind,
                      const std::vector<StripLoads>& strips) {
  ReferenceSolution s;
  StripLoads total;
  double induced_area = 0.0, area = 0.0;
  for (std::size_t i = 0; i < strips.size(); ++i) {
    const StripLoads& strip = strips[i];
    total.thrust_N += strip.thrust_N;
    total.torque_N_m += strip.torque_N_m;
    total.in_plane_N += strip.in_plane_N;
    total.moment_N_m += strip.moment_N_m;
    const double ring_area = geometry.elements[i].r_m * geometry.elements[i].width_m;
    induced_area += ring_area * strip.mean.induced_m_s;
    area += ring_area;
    s.stations.push_back(strip.mean);
  }
  const Eigen::Vector2d in_plane_N = conventions.in_plane_factor * total.in_plane_N;
  s.loads.force_R_N = {in_plane_N.x(), wind.mirror * in_plane_N.y(), conventions.thrust_factor * total.thrust_N};
  s.loads.moment_R_N_m = {wind.mirror * total.moment_N_m.x(), total.moment_N_m.y(), -wind.mirror * total.torque_N_m};
  s.loads.shaft_torque_N_m = total.torque_N_m;
  s.loads.induced_m_s = induced_area / area;
  return s;
}

}  // namespace rotorloop::sim::reference
