// A cable paid out from the ground: the vehicle carries the weight of the length that hangs from it, which is its height above the ground.
// The cable is thin: its inertia and its drag are left out.
#include <algorithm>

#include "sim/effects/body/body_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class HeightPull final : public Effect {
 public:
  explicit HeightPull(const EffectValues& v) : weight_per_length_N_m_(v[0]) {}

  void prepare(PlantSetup& setup) override { ground_z_m_ = setup.body.ground_z_m; }
  void body_loads(const BodyMotion& m, Wrench& w) const override {
    const double hanging_m = std::max(0.0, m.p_W_m.z() - ground_z_m_);
    const Eigen::Vector3d down_B = -m.R_WB.row(2).transpose();
    w.force_B_N += weight_per_length_N_m_ * hanging_m * down_B;
  }

 private:
  double weight_per_length_N_m_, ground_z_m_ = 0.0;
};

}  // namespace

const EffectInfo kHeightPull{
    .id = "height_pull", .parameter = {"k_N_m", "N/m", 0.0, 2.0, 0.0}, .options = {}, .make = make_effect<HeightPull>};

}  // namespace rotorloop::sim
