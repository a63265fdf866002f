// The body's own drag larger or smaller than the plant file says: both drag areas are multiplied by `share`. 0 leaves rotor
// drag alone, which is the flight to compare with when a model has no parasitic drag. Source: paper eq. (5), with Table I
// 0.40 N at 8.5 m/s and 0.79 N at 12 m/s, 6 and 12 % of the weight.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class ParasiticDragShare final : public Effect {
 public:
  explicit ParasiticDragShare(const EffectValues& v) : share_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    setup.body.drag_xy_N_s2_m2 *= share_;
    setup.body.drag_z_N_s2_m2 *= share_;
  }

 private:
  double share_;
};

}  // namespace

const EffectInfo kParasiticDrag{
    .id = "parasitic_drag", .parameter = {"share", "1", 0.0, 3.0, 1.0}, .options = {}, .make = make_effect<ParasiticDragShare>};

}  // namespace rotorloop::sim
