// One ESC's idea of its speed is off by a constant factor: a wrong resonator or magnet count. It holds the set-point by its own
// measure, so the rotor really turns 1 / (1 + error) as fast, while commands and reports agree.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_speed_scale(const EffectValues& v, PlantSetup& setup) {
  const double error = v[0];
  const std::size_t rotor = static_cast<std::size_t>(v[1]) - 1;
  setup.esc[rotor].speed_scale *= 1.0 + error;
}

constexpr EffectOption kRotorSpeedScaleOptions[]{{"rotor", "1", 1.0, 4.0, 1.0, true}};

}  // namespace

const EffectInfo kRotorSpeedScale{.id = "rotor_speed_scale",
                                  .parameter = {"error", "1", -0.2, 0.2, 0.0},
                                  .options = kRotorSpeedScaleOptions,
                                  .make = effect_of<rotor_speed_scale>};

}  // namespace rotorloop::sim
