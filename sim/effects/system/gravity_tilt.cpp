// The pose sensor's idea of the vertical is off: its world stands tilted against gravity, so hover needs a lean that the pose calls level
// flight. Unlike wind it does not change with speed, unlike a displaced mass it does not turn with the vehicle.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void gravity_tilt(const EffectValues& v, PlantSetup& setup) {
  const Eigen::Vector2d tilt_rad(v[1], v[0]);
  setup.pose.tilt_rad += tilt_rad;
}

constexpr EffectOption kGravityTiltOptions[]{{"about_x_rad", "rad", -0.05, 0.05, 0.0}};

}  // namespace

const EffectInfo kGravityTilt{.id = "gravity_tilt",
                              .parameter = {"about_y_rad", "rad", -0.05, 0.05, 0.0},
                              .options = kGravityTiltOptions,
                              .make = effect_of<gravity_tilt>};

}  // namespace rotorloop::sim
