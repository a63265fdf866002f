// The rotor disks stand higher above the centre of mass than nominal: the in-plane force of the rotors then makes a moment that
// pitches the nose up in forward flight, and hubs move sideways when the body rolls or pitches.
#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

void rotor_plane_height(const EffectValues& v, PlantSetup& setup) {
  const double h_m = v[0];
  for (RotorMount& r : setup.body.rotors) r.hub_m.z() += h_m;
}

}  // namespace

const EffectInfo kRotorPlaneHeight{
    .id = "rotor_plane_height", .parameter = {"h_m", "m", -0.05, 0.05, 0.0}, .options = {}, .make = effect_of<rotor_plane_height>};

}  // namespace rotorloop::sim
