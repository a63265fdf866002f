#include "bench/propeller/scaled_blade.hpp"

#include <cmath>
#include <numbers>

namespace rotorloop::propeller {

sim::Blade scaled_blade(sim::Blade blade, double radius_m, double pitch_ratio) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double size = radius_m / blade.radius_m;
  blade.radius_m = radius_m;
  blade.hub_radius_m *= size;
  for (sim::BladeStation& s : blade.stations) {
    s.r_m *= size;
    s.chord_m *= size;
    s.twist_deg = std::atan(std::tan(s.twist_deg * kDegree) * pitch_ratio / size) / kDegree;
  }
  return blade;
}

}  // namespace rotorloop::propeller
