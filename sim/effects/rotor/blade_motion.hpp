// A propeller blade as a stiff beam that may tilt about the hub: inertia, aerodynamic damping and gyroscopic moment of flapping,
// from the geometry of the rotor. Shared by the effects that let blades flap.
// Source: blade flapping about a central hinge, Leishman, Principles of Helicopter Aerodynamics (2006), ch. 4.
#pragma once
#include <Eigen/Core>
#include <cmath>

#include "sim/effects/effect.hpp"
#include "sim/rotor/bem.hpp"

namespace rotorloop::sim {

// Effective lift slope of a small propeller blade, root to tip. Thin sections have 5.7 per radian; at chord Reynolds numbers
// of 1e4 to 8e4, with roots near stall, the blade-element model itself answers to a body rate as if it were 2.8 (1750 rad/s) to
// 3.6 (700 rad/s), which a unit test holds against this value.
inline constexpr double kBladeLiftSlope_1_rad = 3.4;
inline constexpr double kThrustRadiusRatio = 0.7;  // where a blade's thrust acts, over R: 2/3 for triangular loading, 3/4 without tip loss

// One blade of a rotor that turns at `omega` in air of `density`.
struct FlappingBlade {
  double inertia_kg_m2 = 0.0;   // about the hub
  double damping_N_m_s = 0.0;   // moment against the flapping rate: rho a omega / 2 * integral of c r^3
  double upwash_N_m_s_m = 0.0;  // moment per upwash that is the same along the blade: rho a omega / 2 * integral of c r^2
  // Time in which the disk of a freely hinged rotor follows its shaft: 16 / (Lock number * omega).
  double lag_s() const { return 2.0 * inertia_kg_m2 / damping_N_m_s; }
};

inline FlappingBlade flapping_blade(const Rotor& rotor, double omega_rad_s, double density_kg_m3) {
  double c_r2_m4 = 0.0, c_r3_m5 = 0.0;
  for (const Annulus& a : rotor.annuli()) {
    const double c_r2 = a.weight_m * a.chord_m * a.r_m * a.r_m;
    c_r2_m4 += c_r2;
    c_r3_m5 += c_r2 * a.r_m;
  }
  const double k = 0.5 * density_kg_m3 * kBladeLiftSlope_1_rad * omega_rad_s;
  return {rotor.blade_inertia_kg_m2() / rotor.blades(), k * c_r3_m5, k * c_r2_m4};
}

// Angle by which thrust lifts the blades against spring and centrifugal force.
inline double cone_rad(const FlappingBlade& b, double compliance_rad_N_m, double thrust_N, const Rotor& rotor, double omega_rad_s) {
  const double moment_N_m = kThrustRadiusRatio * rotor.radius_m() * thrust_N / rotor.blades();
  return compliance_rad_N_m * moment_N_m / (1.0 + compliance_rad_N_m * b.inertia_kg_m2 * omega_rad_s * omega_rad_s);
}

// The blades' part of what sim/effects/body/gyroscopic puts on the body, when they cannot flap. Frame R, about x and y. Effects take
// it back where blades flap; they count on `gyroscopic` being switched on, as in any plant that is meant to be whole.
inline Eigen::Vector2d blade_gyroscopic_moment_R_N_m(const RotorSite& s) {
  const double H_N_m_s = s.condition.spin * s.rotor->blade_inertia_kg_m2() * s.condition.omega_rad_s;
  return {-s.condition.w_R_rad_s.y() * H_N_m_s, s.condition.w_R_rad_s.x() * H_N_m_s};
}

// Turns the thrust (not the in-plane force) so that it stands on a disk whose normal leans by the tangents `lean`.
inline void lean_thrust(RotorLoads& loads, const Eigen::Vector2d& lean) {
  const double along_N = loads.force_R_N.z() / std::sqrt(1.0 + lean.squaredNorm());
  loads.force_R_N.x() += along_N * lean.x();
  loads.force_R_N.y() += along_N * lean.y();
  loads.force_R_N.z() = along_N;
}

}  // namespace rotorloop::sim
