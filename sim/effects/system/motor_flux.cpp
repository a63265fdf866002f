// Magnets weaker than the data sheet's (warm neodymium loses 0.1 % per kelvin, for good beyond its limit): less torque per ampere and
// less back-EMF per speed. The firmware keeps to the data sheet, so its observer works with a wrong flux.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void motor_flux(const EffectValues& v, PlantSetup& setup) {
  const double scale = v[0];
  for (DriveParameters& d : setup.drive) d.motor.flux_linkage_Wb *= scale;
}

}  // namespace

const EffectInfo kMotorFlux{.id = "motor_flux", .parameter = {"scale", "1", 0.8, 1.1, 1.0}, .options = {}, .make = effect_of<motor_flux>};

}  // namespace rotorloop::sim
