// An accelerometer that clips or squares its vibration shows a constant: a bias along z that grows with the square of rotor speed.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void vibration_rectification(const EffectValues& v, PlantSetup& setup) {
  const double bias_m = v[0];
  setup.imu.rectification_m += bias_m;
}

}  // namespace

const EffectInfo kVibrationRectification{.id = "vibration_rectification",
                                         .parameter = {"bias_per_speed2_m", "m", -1e-6, 1e-6, 0.0},
                                         .options = {},
                                         .make = effect_of<vibration_rectification>};

}  // namespace rotorloop::sim
