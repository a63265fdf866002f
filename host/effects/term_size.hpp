// Sizes that matter are given for the reference quadrotor (0.68 kg, hubs 125 mm from the middle); on a nano-drone a thousandth of a
// moment of inertia decides. A vehicle of other mass and length that flies dynamically alike has times in proportion to the root of
// its length, because gravity is the same (Froude's similarity): the unit of a parameter says by how much its size changes.
#pragma once
#include <cmath>
#include <string_view>

#include "host/effects/loads.hpp"

namespace rotorloop::host {

inline constexpr double kReferenceMass_kg = 0.682, kReferenceArm_m = 0.125;

// Mean distance of the hubs from the geometric centre.
inline double arm_m(const LoadGeometry& g) {
  double sum = 0.0;
  for (const RotorMount& r : g.rotors) sum += std::sqrt(r.position_m.x() * r.position_m.x() + r.position_m.y() * r.position_m.y());
  return sum / kRotors;
}

// Size on a vehicle of this mass and arm over that on the reference quadrotor, for a quantity of this unit ("N s2/m2", "kg m2", "1/s").
// Units other than kg, m, s, N count as the same for all vehicles.
inline double size_ratio(std::string_view unit, double mass_kg, double arm) {
  if (!(mass_kg > 0.0) || !(arm > 0.0)) return 1.0;
  const double mass = mass_kg / kReferenceMass_kg, length = arm / kReferenceArm_m;
  double ratio = 1.0;
  bool below = false;  // behind the stroke
  const auto letter = [&](std::size_t i) {
    return i < unit.size() && ((unit[i] >= 'a' && unit[i] <= 'z') || (unit[i] >= 'A' && unit[i] <= 'Z'));
  };
  for (std::size_t i = 0; i < unit.size();) {
    if (unit[i] == '/') below = true;
    if (!letter(i)) {  // blank, stroke, parenthesis, the figure 1
      ++i;
      continue;
    }
    std::size_t end = i;
    while (letter(end)) ++end;
    const std::string_view name = unit.substr(i, end - i);
    if (end < unit.size() && unit[end] == '^') ++end;
    int power = 1;
    if (end < unit.size() && unit[end] >= '1' && unit[end] <= '9') power = unit[end++] - '0';
    const double one = name == "kg" || name == "N" ? mass : name == "m" ? length : name == "s" ? std::sqrt(length) : 1.0;
    for (; power > 0; --power) ratio = below ? ratio / one : ratio * one;
    i = end;
  }
  return ratio;
}

}  // namespace rotorloop::host
