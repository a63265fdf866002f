// The pose says it was measured at another time than it was: clocks that were never aligned, exposure counted from the wrong edge. At
// 8.5 m/s 10 ms are 85 mm, more than the whole tracking error.
#include <algorithm>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class PoseDelay final : public Effect {
 public:
  explicit PoseDelay(const EffectValues& v) : delay_s_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    setup.pose.stamp_error_s += delay_s_;
    setup.pose.latency_s += std::max(0.0, delay_s_);  // no stamp from the future
  }

 private:
  double delay_s_;
};

}  // namespace

const EffectInfo kPoseDelay{
    .id = "pose_delay", .parameter = {"delay_s", "s", -0.05, 0.05, 0.0}, .options = {}, .make = make_effect<PoseDelay>};

}  // namespace rotorloop::sim
