// What the slow rotor is made of, strip by strip, and what a solution says of each strip.
#pragma once
#include <vector>

#include "sim/rotor/reference/section.hpp"
#include "sim/rotor/rotor_loads.hpp"

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

}  // namespace rotorloop::sim
