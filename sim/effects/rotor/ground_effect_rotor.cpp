// The ground stops the wake; by the image of the rotor below it the disk meets less downwash, and at the same speed and torque
// thrust grows:  T = T_free / (1 - gain (R / 4z)^2 / (1 + (V / v_i)^2)),  z height of the hub, V edgewise speed.
// 6.7 % at one radius, 1.6 % at two. Below half a radius, where the formula has no support, it is held.
// Source: Cheeseman & Bennett, ARC R&M 3021, 1955. Each rotor stands alone; with images of all four: ground_effect_vehicle.
#include <algorithm>

#include "sim/effects/plant_setup.hpp"
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

class GroundEffectRotor final : public Effect {
 public:
  explicit GroundEffectRotor(const EffectValues& v) : gain_(v[0]) {}
  void prepare(PlantSetup& setup) override { ground_z_m_ = setup.body.ground_z_m; }
  void rotor_loads(const RotorSite& s, RotorLoads& loads) override {
    const double R = s.rotor->radius_m(), z = std::max(s.hub_W_m.z() - ground_z_m_, 0.5 * R), image = R / (4.0 * z);
    loads.force_R_N.z() /= 1.0 - gain_ * image * image * wake_below(s);
  }

 private:
  double gain_;
  double ground_z_m_ = 0.0;
};

}  // namespace

const EffectInfo kGroundEffectRotor{
    .id = "ground_effect_rotor", .parameter = {"gain", "1", 0.0, 2.0, 0.0}, .options = {}, .make = make_effect<GroundEffectRotor>};

}  // namespace rotorloop::sim
