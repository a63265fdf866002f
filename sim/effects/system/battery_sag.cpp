// The battery's voltage under load and over the flight. The plant always has it, at share 1; 0 is a stiff supply, larger shares are an old
// or cold pack. Under a speed loop only the ceiling of thrust moves; without one thrust falls with the square of the voltage.
#include <algorithm>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void battery_sag(const EffectValues& v, PlantSetup& setup) {
  constexpr double kStiff = 1e-6;  // of a share of zero: a pack that never empties
  const double share = v[0];
  setup.battery.resistance_ohm *= share;
  setup.battery.relaxation_ohm *= share;
  if (share != 1.0) setup.battery.capacity_A_s /= std::max(share, kStiff);
}

}  // namespace

const EffectInfo kBatterySag{
    .id = "battery_sag", .parameter = {"share", "1", 0.0, 4.0, 1.0}, .options = {}, .make = effect_of<battery_sag>};

}  // namespace rotorloop::sim
