// The air is thinner or denser than nominal: rotors and body drag scale with it, 1 % for 3 K or for 100 m of height. The
// blade-element model also sees the Reynolds number change. Effects whose coefficient lumps density (linear_drag, rate_damping,
// rotor_rolling_moment, lateral_flapping) do not follow.
#include "sim/effects/air/air_list.hpp"

namespace rotorloop::sim {
namespace {

void air_density(const EffectValues& v, const Eigen::Vector3d&, double, Air& air) {
  const double ratio = v[0];
  air.density_kg_m3 *= ratio;
}

}  // namespace

const EffectInfo kAirDensity{
    .id = "air_density", .parameter = {"ratio", "1", 0.6, 1.3, 1.0}, .options = {}, .make = effect_of<air_density>};

}  // namespace rotorloop::sim
