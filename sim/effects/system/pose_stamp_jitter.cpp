// The stamps of the pose scatter: a busy computer reads the clock when it gets round to it. The error it makes grows with speed.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void pose_stamp_jitter(const EffectValues& v, PlantSetup& setup) {
  const double sigma_s = v[0];
  setup.pose.stamp_jitter_s += sigma_s;
}

}  // namespace

const EffectInfo kPoseStampJitter{
    .id = "pose_stamp_jitter", .parameter = {"sigma_s", "s", 0.0, 0.01, 0.0}, .options = {}, .make = effect_of<pose_stamp_jitter>};

}  // namespace rotorloop::sim
