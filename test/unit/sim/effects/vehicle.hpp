// Four rotors at one speed under one effect: what the vehicle feels, and what the effect makes of it.
#pragma once
#include <Eigen/Geometry>
#include <array>

#include "test/unit/sim/effects/fixture.hpp"

namespace rotorloop::sim::test {

inline std::unique_ptr<Effect> prepared(std::string_view id, double value,
                                        const std::vector<std::pair<std::string_view, double>>& options = {}) {
  auto effect = make(id, value, options);
  PlantSetup setup = reference_setup();
  effect->prepare(setup);
  return effect;
}

// Level, nose along x, in still air.
inline BodyMotion flying(const Eigen::Vector3d& v_m_s, double z_m = 100.0) {
  BodyMotion m;
  m.p_W_m = {0.0, 0.0, z_m};
  m.v_W_m_s = m.v_air_B_m_s = v_m_s;
  m.density_kg_m3 = kDensity;
  return m;
}

using FourRotorLoads = std::array<RotorLoads, 4>;
inline FourRotorLoads four_loads(Effect& effect, const BodyMotion& body, double omega_rad_s = hover_omega()) {
  FourRotorLoads loads;
  for (std::size_t i = 0; i < 4; ++i) loads[i] = loads_with(effect, site(i, body, omega_rad_s));
  return loads;
}
inline FourRotorLoads four_bare_loads(const BodyMotion& body, double omega_rad_s = hover_omega()) {
  Effect none;
  return four_loads(none, body, omega_rad_s);
}

// Force and moment of the four rotors about the centre of mass.
inline Wrench sum(const FourRotorLoads& loads) {
  Wrench w;
  for (std::size_t i = 0; i < 4; ++i) {
    w.force_B_N += loads[i].force_R_N;
    w.moment_B_N_m += loads[i].moment_R_N_m + reference_body().rotors[i].hub_m.cross(loads[i].force_R_N);
  }
  return w;
}

inline double thrust_N(const RotorLoads& l) { return l.force_R_N.z(); }

// Thrust of rotor `i` with the effect over that without.
inline double thrust_ratio(Effect& effect, const BodyMotion& body, std::size_t i = 0) {
  const RotorSite s = site(i, body, hover_omega());
  return thrust_N(loads_with(effect, s)) / thrust_N(solved(s));
}

// All that an effect on the thrust alone must leave untouched.
inline double largest_change_beside_thrust(const RotorLoads& a, const RotorLoads& b) {
  return (a.force_R_N.head<2>() - b.force_R_N.head<2>()).norm() + (a.moment_R_N_m - b.moment_R_N_m).norm() +
         std::fabs(a.shaft_torque_N_m - b.shaft_torque_N_m);
}

}  // namespace rotorloop::sim::test
