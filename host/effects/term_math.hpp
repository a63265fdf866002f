// Small things that several terms need: elementary functions with exact derivatives, the rotor in still air after eq. (1)-(2), and
// forces that act at a hub.
#pragma once
#include "host/base/elementary.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::host {

template <class S>
S positive_part(const S& x) {  // max(0, x); the slope at 0 is taken as 0
  return value_of(x) > 0.0 ? x : S(0.0);
}
template <class S>
S squared(const S& x) {
  return x * x;
}
// base^exponent of base > 0.
template <class S>
S power(const S& base, const S& exponent) {
  const double log = log_exact(value_of(base));
  const S e = exponent * chained(base, log, 1.0 / value_of(base));
  const double v = exp_exact(value_of(e));
  return chained(e, v, v);
}

// Across the shaft, squared, m2/s2.
template <class S>
S across2(const Vec3<S>& v) {
  return v.x * v.x + v.y * v.y;
}

// Momentum factor 2 ρ A of eq. (2), kg/m.
inline double momentum_kg_m(const LoadGeometry& g) { return 2.0 * g.air_density_kg_m3 * 3.14159265358979323846 * g.radius_m * g.radius_m; }

// Induced velocity in still air over rotor speed, m: the root U of 2ρA U² - k2 U - k1 = 0; thrust is then 2ρA U² ω².
template <class S>
S still_flow_m(const LoadState<S>& s) {
  const double q = momentum_kg_m(s.geometry);
  const S& k2 = s.parameters.k2_N_s2_m;
  return (k2 + square_root(k2 * k2 + 4.0 * q * s.parameters.k1_N_s2)) * (0.5 / q);
}

// Rotor speed that carries the nominal mass in still air, rad/s.
template <class S>
S hover_speed_rad_s(const LoadState<S>& s) {
  const double weight = s.geometry.mass_kg * kGravity_m_s2;
  return square_root(weight / (kRotors * momentum_kg_m(s.geometry) * squared(still_flow_m(s))));
}

// +1 for a rotor that turns counter-clockwise seen from above: the air drags it, and through it the body, clockwise.
template <class S>
double spin(const LoadState<S>& s, std::size_t i) {
  return -s.geometry.rotors[i].reaction;
}

// Share of the hover inflow that neighbours and surfaces still act on in edgewise flight, 1 / (1 + (v_xy / v_i)²).
template <class S>
S wake_below(const RotorLoad<S>& r) {
  const S induced2 = squared(positive_part(r.through_m_s - r.v_air_B_m_s.z));
  return induced2 / (induced2 + across2(r.v_air_B_m_s) + 1e-12);
}

// A force given in world axes, at the centre of mass.
template <class S>
void push_in_world(LoadState<S>& s, const Vec3<S>& f_W) {
  s.force_B_N += scaled(f_W.x, s.in.world_B[0]) + scaled(f_W.y, s.in.world_B[1]) + scaled(f_W.z, s.in.world_B[2]);
}

// Airframe drag of eq. (5).
template <class S>
Vec3<S> airframe_drag(const LoadState<S>& s) {
  const Vec3<S>& v = s.v_air_B_m_s;
  const LoadParameters<S>& p = s.parameters;
  return {-(p.c_dxy_N_s2_m2 * v.x * magnitude(v.x)), -(p.c_dxy_N_s2_m2 * v.y * magnitude(v.y)), -(p.c_dz_N_s2_m2 * v.z * magnitude(v.z))};
}

}  // namespace rotorloop::host
