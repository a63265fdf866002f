// What happens where on the disk: the solve's blade elements one by one, for pictures and for whoever wants to know which part of
// a blade stalls. Slow (plain code, heap); the loop uses solve_rotor, whose loads are the integral of this map.
#pragma once
#include <vector>

#include "sim/rotor/bem.hpp"

namespace rotorloop::sim {

// One cell of the disk, around one radius and one azimuth. Frame R; time average of all blades passing.
struct DiskCell {
  double r_m;
  double psi_rad;            // [0, 2 pi), from x of R towards y, whichever way the rotor turns
  double area_m2;            // what the cell stands for in an integral; the sum over all cells is the disk's area within quadrature error
  double thrust_N_per_m2;    // along z of R
  double torque_N_m_per_m2;  // resisting rotation
  double alpha_rad;          // angle of attack of the blade section, (-pi, pi]
  double reynolds;           // of the chord, at the section's own speed (the polars are clamped, this is not)
  double through_m_s;        // speed of the air through the disk along -z, seen by the blade: climb + induced + body rate
  double induced_m_s;        // part of it that the rotor induces, with the skew of the wake
  double tangential_m_s;     // speed of the air against the blade's motion; negative in reverse flow
};

struct RotorDisk {
  int radial = 0, azimuth = 0;
  std::vector<DiskCell> cells;  // cells[i * azimuth + k]: annulus i from hub to tip, azimuth k in the order the blades pass it
  RotorLoads loads;             // of solve_rotor in the same condition, from a cold start

  const DiskCell& at(int i, int k) const { return cells[static_cast<std::size_t>(i * azimuth + k)]; }
};

// Azimuth nodes lie in the middle of cells of equal width 2 pi / azimuth. A solve that did not converge gives no cells.
RotorDisk solve_rotor_disk(const Rotor& rotor, const RotorCondition& condition);

}  // namespace rotorloop::sim
