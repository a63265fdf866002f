// Windings warmer or thinner than the data sheet's: copper gains 39 % of resistance over 100 K. Under a speed loop the speed stays
// and current, heat and the ceiling of speed change. The firmware keeps believing the data sheet.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class MotorResistance final : public Effect {
 public:
  explicit MotorResistance(const EffectValues& v) : scale_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    for (DriveParameters& d : setup.drive) d.motor.resistance_ohm *= scale_;
  }

 private:
  double scale_;
};

}  // namespace

const EffectInfo kMotorResistance{
    .id = "motor_resistance", .parameter = {"scale", "1", 0.5, 3.0, 1.0}, .options = {}, .make = make_effect<MotorResistance>};

}  // namespace rotorloop::sim
