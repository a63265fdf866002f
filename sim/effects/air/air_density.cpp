// The air is thinner or denser than believed: rotors and body drag scale with it, 1 % for 3 K or for 100 m of height. The
// blade-element solve also sees the Reynolds number change. Effects whose coefficient lumps density (linear_drag, rate_damping,
// rotor_rolling_moment, lateral_flapping) do not follow.
#include "sim/effects/air/air_list.hpp"

namespace rotorloop::sim {
namespace {

class AirDensity final : public Effect {
 public:
  explicit AirDensity(const EffectValues& v) : ratio_(v[0]) {}
  void air(const Eigen::Vector3d&, double, Air& air) const override { air.density_kg_m3 *= ratio_; }

 private:
  double ratio_;
};

}  // namespace

const EffectInfo kAirDensity{
    .id = "air_density", .parameter = {"ratio", "1", 0.6, 1.3, 1.0}, .options = {}, .make = make_effect<AirDensity>};

}  // namespace rotorloop::sim
