// Rotor speed follows the command as a first-order lag, as an ESC without a speed loop lets it: in place of firmware, inverter and
// motor. Time constants of 12 to 50 ms are common in simulators; the speed loop of the firmware here is faster.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

class DriveLag final : public Effect {
 public:
  explicit DriveLag(const EffectValues& v) : tau_s_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    for (EscSetup& e : setup.esc) e.lag_s += tau_s_;
  }

 private:
  double tau_s_;
};

}  // namespace

const EffectInfo kDriveLag{.id = "drive_lag", .parameter = {"tau_s", "s", 0.0, 0.1, 0.0}, .options = {}, .make = make_effect<DriveLag>};

}  // namespace rotorloop::sim
