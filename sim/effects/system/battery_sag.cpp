// The battery's voltage under load and over the flight. The plant always has it, at share 1; 0 is a stiff supply, larger shares are an old
// or cold pack. Under a speed loop only the ceiling of thrust moves; without one thrust falls with the square of the voltage.
#include <algorithm>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class BatterySag final : public Effect {
 public:
  explicit BatterySag(const EffectValues& v) : share_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    setup.battery.resistance_ohm *= share_;
    setup.battery.relaxation_ohm *= share_;
    if (share_ != 1.0) setup.battery.capacity_A_s /= std::max(share_, kStiff);
  }

 private:
  static constexpr double kStiff = 1e-6;  // of a share of zero: a pack that never empties
  double share_;
};

}  // namespace

const EffectInfo kBatterySag{
    .id = "battery_sag", .parameter = {"share", "1", 0.0, 4.0, 1.0}, .options = {}, .make = make_effect<BatterySag>};

}  // namespace rotorloop::sim
