// Everything that the ESCs send passes a slow gateway: speeds reach log and controller later than the pose of the same instant.
// Physics is untouched; forces computed from logged speeds lag behind the motion.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_speed_delay(const EffectValues& v, PlantSetup& setup) {
  const std::int64_t delay_ns(static_cast<std::int64_t>(v[0] * 1e9 + 0.5));
  for (EscSetup& e : setup.esc) e.report_delay_ns += delay_ns;
}

}  // namespace

const EffectInfo kRotorSpeedDelay{
    .id = "rotor_speed_delay", .parameter = {"delay_s", "s", 0.0, 0.05, 0.0}, .options = {}, .make = effect_of<rotor_speed_delay>};

}  // namespace rotorloop::sim
