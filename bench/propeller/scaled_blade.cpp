#include "bench/propeller/scaled_blade.hpp"

#include <cmath>

#include "host/base/constants.hpp"

namespace rotorloop::propeller {

sim::Blade scaled_blade(sim::Blade blade, double radius_m, double pitch_ratio) {
  const double size = radius_m / blade.radius_m;
  blade.radius_m = radius_m;
  blade.hub_radius_m *= size;
  for (sim::BladeStation& s : blade.stations) {
    s.r_m *= size;
    s.chord_m *= size;
    s.twist_deg = std::atan(std::tan(s.twist_deg * kRad_per_deg) * pitch_ratio / size) / kRad_per_deg;
  }
  return blade;
}

}  // namespace rotorloop::propeller
