// Blades that flutter in a narrow band of rotor speed and lose thrust there: T (1 - loss b), b = 1 in the middle of the band and 0
// outside it. No power of the rotor speed looks like it.
#include <cmath>

#include "sim/effects/foreign/foreign_list.hpp"

namespace rotorloop::sim {
namespace {

class BladeFlutter final : public Effect {
 public:
  explicit BladeFlutter(const EffectValues& v) : loss_(v[0]), centre_rad_s_(v[1]), width_rad_s_(v[2]) {}
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    const double u = (s.condition.omega_rad_s - centre_rad_s_) / width_rad_s_;
    if (std::fabs(u) < 1.0) loads.force_R_N.z() *= 1.0 - loss_ * (1.0 - u * u) * (1.0 - u * u);
  }

 private:
  double loss_, centre_rad_s_, width_rad_s_;
};

constexpr EffectOption kOptions[]{{"centre_rad_s", "rad/s", 100.0, 3000.0, 1030.0}, {"width_rad_s", "rad/s", 5.0, 500.0, 50.0}};

}  // namespace

const EffectInfo kForeignBladeFlutter{
    .id = "foreign_blade_flutter", .parameter = {"loss", "1", 0.0, 0.5, 0.0}, .options = kOptions, .make = make_effect<BladeFlutter>};

}  // namespace rotorloop::sim
