// The air's side of the balance for the reference rotor, written from the formulas in the first comment of sim/rotor/inflow.hpp
// without its table.
#pragma once
#include "sim/rotor/reference/conventions.hpp"

namespace rotorloop::sim {

// vi/vh over x = Vz/vh in [-2, 0]: the quartic of Leishman 2006, eq. 2.96. Vz is positive in climb.
double descent_quartic(double climb_over_hover_induced);

struct MassFlow {
  double speed_m_s;  // U: thrust of an area A is 2 rho A v U
  double ring;       // 0: momentum theory; 1: fully empirical
};
// v: induced velocity, positive along -z. Descent::quartic is a correction of the solution, so here it counts as momentum.
MassFlow reference_mass_flow(double induced_m_s, double climb_m_s, double edgewise_m_s, Descent descent);

// Prandtl's (2/pi) acos(exp(-f)).
double prandtl_share(double f);

}  // namespace rotorloop::sim
