// The slow rotor: blade elements, the air's side of the balance and a bracketed root search, written to be read beside the
// equations. Frames, signs and units are those of sim/rotor/rotor.hpp.
#pragma once
#include <vector>

#include "sim/rotor/blade.hpp"
#include "sim/rotor/reference/conventions.hpp"
#include "sim/rotor/reference/section.hpp"
#include "sim/rotor/rotor.hpp"

namespace rotorloop::sim {

// A strip of every blade; properties are taken at its middle r_m.
struct ReferenceElement {
  double r_m, width_m;
  double chord_m, twist_rad;
  Section section;
};

struct ReferenceGeometry {
  int blades = 2;
  double radius_m = 0.0;
  double hub_radius_m = 0.0;  // lift starts here
  std::vector<ReferenceElement> elements;
};

// Of a blade file: chord and twist by monotone cubics (Fritsch & Butland 1984), polars blended between stations, stall delay by
// section. The blade must outlive the geometry. Strips shrink towards hub and tip, where Prandtl's loss falls like a square root.
ReferenceGeometry reference_geometry(const Blade& blade, int elements);

// What happens at one element, averaged over azimuth.
struct ReferenceStation {
  double r_m;
  double induced_m_s;     // axial, along -z
  double axial_m_s;       // through the disk, climb included
  double tangential_m_s;  // against the blade
  double cl, cd, reynolds, mach;
  double thrust_N;  // of this strip, all blades
};

struct ReferenceSolution {
  RotorLoads loads;
  std::vector<ReferenceStation> stations;
};

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
