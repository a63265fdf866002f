// Windings warmer or thinner than the data sheet's: copper gains 39 % of resistance over 100 K. Under a speed loop the speed stays
// and current, heat and the ceiling of speed change. The firmware keeps to the data sheet.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void motor_resistance(const EffectValues& v, PlantSetup& setup) {
  const double scale = v[0];
  for (DriveParameters& d : setup.drive) d.motor.resistance_ohm *= scale;
}

}  // namespace

const EffectInfo kMotorResistance{
    .id = "motor_resistance", .parameter = {"scale", "1", 0.5, 3.0, 1.0}, .options = {}, .make = effect_of<motor_resistance>};

}  // namespace rotorloop::sim
