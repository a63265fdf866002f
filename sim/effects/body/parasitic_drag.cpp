// The body's own drag larger or smaller than the plant file says: both drag areas are multiplied by `share`. 0 leaves rotor
// drag alone, which is the flight to compare with when a model has no parasitic drag. Source: paper eq. (5), with Table I
// 0.40 N at 8.5 m/s and 0.79 N at 12 m/s, 6 and 12 % of the weight.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

void parasitic_drag_share(const EffectValues& v, PlantSetup& setup) {
  const double share = v[0];
  setup.body.drag_xy_N_s2_m2 *= share;
  setup.body.drag_z_N_s2_m2 *= share;
}

}  // namespace

const EffectInfo kParasiticDrag{
    .id = "parasitic_drag", .parameter = {"share", "1", 0.0, 3.0, 1.0}, .options = {}, .make = effect_of<parasitic_drag_share>};

}  // namespace rotorloop::sim
