// One motor stands askew on its arm: its thrust leans over by the angle, 1 degree is 1.7 % of it sideways (0.03 N in hover), and
// at the end of an arm that is a yaw moment too.
#include <cmath>
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class RotorTilt final : public Effect {
 public:
  explicit RotorTilt(const EffectValues& v)
      : tilt_rad_(v[0] * kRadians), rotor_(static_cast<std::size_t>(v[1]) - 1), towards_rad_(v[2] * kRadians) {}
  void prepare(PlantSetup& setup) override {
    // RotorMount: tilt[0] > 0 leans the thrust to -y, tilt[1] > 0 to +x.
    const SinCos towards = sincos_exact(towards_rad_);
    setup.body.rotors[rotor_].tilt_rad += tilt_rad_ * Eigen::Vector2d(-towards.sin, towards.cos);
  }

 private:
  static constexpr double kRadians = std::numbers::pi / 180.0;
  double tilt_rad_;
  std::size_t rotor_;
  double towards_rad_;
};

constexpr EffectOption kOptions[]{{"rotor", "1", 1.0, 4.0, 1.0, true}, {"towards_deg", "deg", -360.0, 360.0, 0.0}};

}  // namespace

const EffectInfo kRotorTilt{
    .id = "rotor_tilt", .parameter = {"tilt_deg", "deg", -10.0, 10.0, 0.0}, .options = kOptions, .make = make_effect<RotorTilt>};

}  // namespace rotorloop::sim
