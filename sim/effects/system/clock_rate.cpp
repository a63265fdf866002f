// Stamps by a crystal that runs fast, or counted in samples of a nominal rate: the pose is older than it says by more and more.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void clock_rate(const EffectValues& v, PlantSetup& setup) {
  const double rate = v[0];
  setup.pose.stamp_rate_error += rate;
}

}  // namespace

const EffectInfo kClockRate{.id = "clock_rate", .parameter = {"rate", "1", -0.01, 0.01, 0.0}, .options = {}, .make = effect_of<clock_rate>};

}  // namespace rotorloop::sim
