// Visual odometry with a wrong scale (a stereo base line that bent, a monocular camera): positions and velocities too large by one
// factor, attitudes right.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void pose_scale(const EffectValues& v, PlantSetup& setup) {
  const double error = v[0];
  setup.pose.scale_error += error;
}

}  // namespace

const EffectInfo kPoseScale{.id = "pose_scale", .parameter = {"error", "1", -0.1, 0.1, 0.0}, .options = {}, .make = effect_of<pose_scale>};

}  // namespace rotorloop::sim
