// The pose sensor's idea of the vertical is off: its world stands tilted against gravity, so hover needs a lean that the pose calls level
// flight. Unlike wind it does not change with speed, unlike a displaced mass it does not turn with the vehicle.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class GravityTilt final : public Effect {
 public:
  explicit GravityTilt(const EffectValues& v) : tilt_rad_(v[1], v[0]) {}
  void prepare(PlantSetup& setup) override { setup.pose.tilt_rad += tilt_rad_; }

 private:
  Eigen::Vector2d tilt_rad_;
};

constexpr EffectOption kOptions[]{{"about_x_rad", "rad", -0.05, 0.05, 0.0}};

}  // namespace

const EffectInfo kGravityTilt{
    .id = "gravity_tilt", .parameter = {"about_y_rad", "rad", -0.05, 0.05, 0.0}, .options = kOptions, .make = make_effect<GravityTilt>};

}  // namespace rotorloop::sim
