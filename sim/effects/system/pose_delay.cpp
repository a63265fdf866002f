// The pose says it was measured at another time than it was: clocks that were never aligned, exposure counted from the wrong edge. At
// 8.5 m/s 10 ms are 85 mm, more than the whole tracking error.
#include <algorithm>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void pose_delay(const EffectValues& v, PlantSetup& setup) {
  const double delay_s = v[0];
  setup.pose.stamp_error_s += delay_s;
  setup.pose.latency_s += std::max(0.0, delay_s);  // no stamp from the future
}

}  // namespace

const EffectInfo kPoseDelay{
    .id = "pose_delay", .parameter = {"delay_s", "s", -0.05, 0.05, 0.0}, .options = {}, .make = effect_of<pose_delay>};

}  // namespace rotorloop::sim
