// Magnets weaker than the data sheet's (warm neodymium loses 0.1 % per kelvin, for good beyond its limit): less torque per ampere and
// less back-EMF per speed. The firmware keeps believing the data sheet, so its observer works with a wrong flux.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class MotorFlux final : public Effect {
 public:
  explicit MotorFlux(const EffectValues& v) : scale_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    for (DriveParameters& d : setup.drive) d.motor.flux_linkage_Wb *= scale_;
  }

 private:
  double scale_;
};

}  // namespace

const EffectInfo kMotorFlux{.id = "motor_flux", .parameter = {"scale", "1", 0.8, 1.1, 1.0}, .options = {}, .make = make_effect<MotorFlux>};

}  // namespace rotorloop::sim
