// What several effects ask of a rotor's wake: how fast it would be in hover, how much of it is still below the disk in edgewise
// flight, and whether it has rolled up into a vortex ring around the disk.
#pragma once
#include <algorithm>
#include <cmath>

#include "sim/effects/effect.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::sim {

inline double edgewise_m_s(const RotorCondition& c) { return std::sqrt(c.v_R_m_s.x() * c.v_R_m_s.x() + c.v_R_m_s.y() * c.v_R_m_s.y()); }

// Induced velocity of a hovering rotor with this thrust: v_h = sqrt(T / (2 rho A)). Zero without thrust.
inline double hover_induced_m_s(const RotorSite& site) {
  const double thrust_N = std::max(site.bare.force_R_N.z(), 0.0), density_kg_m3 = site.condition.density_kg_m3;
  return density_kg_m3 > 0.0 ? std::sqrt(thrust_N / (2.0 * density_kg_m3 * site.rotor->disk_area_m2())) : 0.0;
}

// Share of an effect of the wake on what is below or beside the rotor, 1 in hover, falling as edgewise flow blows the wake back:
// 1 / (1 + (V / v_i)^2), the factor of Cheeseman & Bennett (ARC R&M 3021, 1955) for ground effect in forward flight.
inline double wake_below(const RotorSite& site) {
  const double induced_m_s = std::max(site.bare.induced_m_s, 0.0), edge_m_s = edgewise_m_s(site.condition);
  const double induced2 = induced_m_s * induced_m_s;
  return induced2 > 0.0 ? induced2 / (induced2 + edge_m_s * edge_m_s) : 0.0;
}

// 0 outside the vortex ring state, 1 in the middle of it: a smooth bump over descent at 0.3 to 1.7 v_h, which edgewise flow
// blows away until 0.95 v_h (bounds: Johnson, NASA TP-2005-213477, stability boundary of measured rotors).
inline double ring_state(const RotorSite& site) {
  constexpr double kMiddle = 1.0, kHalfWidth = 0.7, kEdgewiseEnd = 0.95;
  const double hover_m_s = hover_induced_m_s(site);
  if (hover_m_s <= 0.0) return 0.0;
  const double u = (-site.condition.v_R_m_s.z() / hover_m_s - kMiddle) / kHalfWidth;
  const double edge = edgewise_m_s(site.condition) / (kEdgewiseEnd * hover_m_s), m = edge * edge;
  if (std::fabs(u) >= 1.0 || m >= 1.0) return 0.0;
  return (1.0 - u * u) * (1.0 - u * u) * (1.0 - m) * (1.0 - m) * (1.0 + 2.0 * m);
}

}  // namespace rotorloop::sim
