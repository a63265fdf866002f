// Polars that XFLR5 exports as text: lift and drag of one section at one Reynolds number, over the angles where XFOIL converged.
#pragma once
#include <string>
#include <vector>

#include "bench/propeller/text_file.hpp"

namespace rotorloop::propeller {

struct SectionPolar {
  std::string airfoil;
  double reynolds = 0.0;
  double n_crit = 0.0;                    // amplification at transition: 9 a quiet tunnel, 6 disturbed air
  std::vector<double> alpha_deg, cl, cd;  // rising angles, a few degrees apart at most where it matters
};

// Throws Error, also for a polar that does not cover small angles.
SectionPolar read_xflr5_polar(const TextFile& file);

}  // namespace rotorloop::propeller
