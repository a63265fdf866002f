// A gyro whose sensitivity is off: rates too large by one factor, on all axes or on one.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

constexpr EffectOption kGyroAxis[] = {{"axis", "1", 0.0, 3.0, 0.0, true}};  // 0: all; 1 to 3: x, y, z

void gyro_scale(const EffectValues& v, PlantSetup& setup) {
  const double error = v[0];
  const int axis = static_cast<int>(v[1]);
  for (int i = 0; i < 3; ++i) {
    if (axis == 0 || axis == i + 1) setup.imu.gyro_gain.row(i) *= 1.0 + error;
  }
}

}  // namespace

const EffectInfo kGyroScale{
    .id = "gyro_scale", .parameter = {"error", "1", -0.2, 0.2, 0.0}, .options = kGyroAxis, .make = effect_of<gyro_scale>};

}  // namespace rotorloop::sim
