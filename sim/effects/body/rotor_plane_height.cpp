// The rotor disks stand higher above the centre of mass than believed: the in-plane force of the rotors then makes a moment that
// pitches the nose up in forward flight, and hubs move sideways when the body rolls or pitches.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class RotorPlaneHeight final : public Effect {
 public:
  explicit RotorPlaneHeight(const EffectValues& v) : h_m_(v[0]) {}
  void prepare(PlantSetup& setup) override {
    for (RotorMount& r : setup.body.rotors) r.hub_m.z() += h_m_;
  }

 private:
  double h_m_;
};

}  // namespace

const EffectInfo kRotorPlaneHeight{
    .id = "rotor_plane_height", .parameter = {"h_m", "m", -0.05, 0.05, 0.0}, .options = {}, .make = make_effect<RotorPlaneHeight>};

}  // namespace rotorloop::sim
