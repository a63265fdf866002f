// The stamps of the pose scatter: a busy computer reads the clock when it gets round to it. The error it makes grows with speed.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class PoseStampJitter final : public Effect {
 public:
  explicit PoseStampJitter(const EffectValues& v) : sigma_s_(v[0]) {}
  void prepare(PlantSetup& setup) override { setup.pose.stamp_jitter_s += sigma_s_; }

 private:
  double sigma_s_;
};

}  // namespace

const EffectInfo kPoseStampJitter{
    .id = "pose_stamp_jitter", .parameter = {"sigma_s", "s", 0.0, 0.01, 0.0}, .options = {}, .make = make_effect<PoseStampJitter>};

}  // namespace rotorloop::sim
