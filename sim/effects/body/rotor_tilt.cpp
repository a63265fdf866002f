// One motor stands askew on its arm: its thrust leans over by the angle, 1 degree is 1.7 % of it sideways (0.03 N in hover), and
// at the end of an arm that is a yaw moment too.
#include <cmath>

#include "host/base/constants.hpp"
#include "host/base/elementary.hpp"
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

void rotor_tilt(const EffectValues& v, PlantSetup& setup) {
  const double tilt_rad = v[0] * kRad_per_deg, towards_rad = v[2] * kRad_per_deg;
  const std::size_t rotor = static_cast<std::size_t>(v[1]) - 1;
  // RotorMount: tilt[0] > 0 leans the thrust to -y, tilt[1] > 0 to +x.
  const SinCos towards = sincos_exact(towards_rad);
  setup.body.rotors[rotor].tilt_rad += tilt_rad * Eigen::Vector2d(-towards.sin, towards.cos);
}

constexpr EffectOption kRotorTiltOptions[]{{"rotor", "1", 1.0, 4.0, 1.0, true}, {"towards_deg", "deg", -360.0, 360.0, 0.0}};

}  // namespace

const EffectInfo kRotorTilt{
    .id = "rotor_tilt", .parameter = {"tilt_deg", "deg", -10.0, 10.0, 0.0}, .options = kRotorTiltOptions, .make = effect_of<rotor_tilt>};

}  // namespace rotorloop::sim
