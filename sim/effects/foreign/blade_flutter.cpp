// Blades that flutter in a narrow band of rotor speed and lose thrust there: T (1 - loss b), b = 1 in the middle of the band and 0
// outside it. No power of the rotor speed looks like it.
#include <cmath>

#include "sim/effects/foreign/foreign_list.hpp"

namespace rotorloop::sim {
namespace {

void blade_flutter(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double loss = v[0], centre_rad_s = v[1], width_rad_s = v[2];
  const double u = (s.condition.omega_rad_s - centre_rad_s) / width_rad_s;
  if (std::fabs(u) < 1.0) loads.force_R_N.z() *= 1.0 - loss * (1.0 - u * u) * (1.0 - u * u);
}

constexpr EffectOption kForeignBladeFlutterOptions[]{{"centre_rad_s", "rad/s", 100.0, 3000.0, 1030.0},
                                                     {"width_rad_s", "rad/s", 5.0, 500.0, 50.0}};

}  // namespace

const EffectInfo kForeignBladeFlutter{.id = "foreign_blade_flutter",
                                      .parameter = {"loss", "1", 0.0, 0.5, 0.0},
                                      .options = kForeignBladeFlutterOptions,
                                      .make = effect_of<blade_flutter>};

}  // namespace rotorloop::sim
