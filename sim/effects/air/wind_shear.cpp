// Wind that grows with height above the ground, linearly about a reference height: the boundary layer as a small vehicle meets it.
// Rotors of a tilted vehicle stand at different heights, so it is a (small) moment as well.
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/effects/air/air_list.hpp"
#include "sim/effects/plant_setup.hpp"

namespace rotorloop::sim {
namespace {

class WindShear final : public Effect {
 public:
  explicit WindShear(const EffectValues& v) : reference_m_(v[2]) {
    const SinCos towards = sincos_exact(v[1] * std::numbers::pi / 180.0);
    gradient_W_1_s_ = {v[0] * towards.cos, v[0] * towards.sin, 0.0};
  }
  void prepare(PlantSetup& setup) override { ground_z_m_ = setup.body.ground_z_m; }
  void air(const Eigen::Vector3d& p_W_m, double, Air& air) const override {
    air.wind_W_m_s += (p_W_m.z() - ground_z_m_ - reference_m_) * gradient_W_1_s_;
  }

 private:
  Eigen::Vector3d gradient_W_1_s_;
  double reference_m_, ground_z_m_ = 0.0;
};

constexpr EffectOption kWindShearOptions[]{{"towards_deg", "deg", -360.0, 360.0, 0.0}, {"reference_height_m", "m", 0.0, 1000.0, 0.0}};

}  // namespace

const EffectInfo kWindShear{
    .id = "wind_shear", .parameter = {"gradient_1_s", "1/s", -5.0, 5.0, 0.0}, .options = kWindShearOptions, .make = make_effect<WindShear>};

}  // namespace rotorloop::sim
