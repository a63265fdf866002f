// The slow rotor: blade elements, the air's side of the balance and a bracketed root search, written to be read beside the
// equations. Frames, signs and units are those of sim/rotor/rotor_loads.hpp.
#pragma once
#include "sim/rotor/reference/conventions.hpp"
#include "sim/rotor/reference/geometry.hpp"
#include "sim/rotor/rotor_loads.hpp"

namespace rotorloop::sim {

class ReferenceRotor {
 public:
  // Throws Error for no elements, fewer than four azimuths, or Descent::quartic without uniform inflow.
  ReferenceRotor(ReferenceGeometry geometry, const RotorConventions& conventions, int azimuths = 64);

  const RotorConventions& conventions() const { return conventions_; }
  double disk_area_m2() const;  // pi R^2

  // A steady state. Status and iterations as solve_rotor gives them, `iterations` the most evaluations of any search. Throws Error
  // for edgewise flow, body rates or descent with Inflow::circulation, whose wake is that of axial flow from above.
  ReferenceSolution solve(const RotorCondition& condition) const;

  // The blades' side alone, with one induced velocity held over the disk; the air need not agree.
  ReferenceSolution at_induced(const RotorCondition& condition, double induced_m_s) const;

 private:
  ReferenceGeometry geometry_;
  RotorConventions conventions_;
  int azimuths_;
};

}  // namespace rotorloop::sim
