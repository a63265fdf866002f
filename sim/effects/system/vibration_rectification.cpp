// An accelerometer that clips or squares its vibration shows a constant: a bias along z that grows with the square of rotor speed.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class VibrationRectification final : public Effect {
 public:
  explicit VibrationRectification(const EffectValues& v) : bias_m_(v[0]) {}
  void prepare(PlantSetup& setup) override { setup.imu.rectification_m += bias_m_; }

 private:
  double bias_m_;
};

}  // namespace

const EffectInfo kVibrationRectification{.id = "vibration_rectification",
                                         .parameter = {"bias_per_speed2_m", "m", -1e-6, 1e-6, 0.0},
                                         .options = {},
                                         .make = make_effect<VibrationRectification>};

}  // namespace rotorloop::sim
