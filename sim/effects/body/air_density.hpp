// Aerodynamic coefficients of this folder are given for the standard atmosphere and scale with the air around, except those that
// lump the density with more (linear_drag, rate_damping).
#pragma once
#include "sim/airframe/body_loads.hpp"

namespace rotorloop::sim {

inline constexpr double kStandardDensity_kg_m3 = 1.225;  // ISO 2533, sea level

inline double density_ratio(const BodyMotion& m) { return m.density_kg_m3 / kStandardDensity_kg_m3; }

}  // namespace rotorloop::sim
