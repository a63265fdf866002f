// Rotor speed follows the command as a first-order lag, as an ESC without a speed loop lets it: in place of firmware, inverter and
// motor. Time constants of 12 to 50 ms are common in simulators; the speed loop of the firmware here is faster.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void drive_lag(const EffectValues& v, PlantSetup& setup) {
  const double tau_s = v[0];
  for (EscSetup& e : setup.esc) e.lag_s += tau_s;
}

}  // namespace

const EffectInfo kDriveLag{.id = "drive_lag", .parameter = {"tau_s", "s", 0.0, 0.1, 0.0}, .options = {}, .make = effect_of<drive_lag>};

}  // namespace rotorloop::sim
