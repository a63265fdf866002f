// Visual odometry with a wrong scale (a stereo base line that bent, a monocular camera): positions and velocities too large by one
// factor, attitudes right.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class PoseScale final : public Effect {
 public:
  explicit PoseScale(const EffectValues& v) : error_(v[0]) {}
  void prepare(PlantSetup& setup) override { setup.pose.scale_error += error_; }

 private:
  double error_;
};

}  // namespace

const EffectInfo kPoseScale{.id = "pose_scale", .parameter = {"error", "1", -0.1, 0.1, 0.0}, .options = {}, .make = make_effect<PoseScale>};

}  // namespace rotorloop::sim
