// A constant force on the body, fixed in its axes: what is left when nothing physical explains a force that neither speed nor
// thrust changes. Honest only as a last resort, so the plant has it to teach diagnosis the difference. The parameter is the
// component along z, the options those along x and y.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

class BodyForceBias final : public Effect {
 public:
  explicit BodyForceBias(const EffectValues& v) : force_B_N_(v[1], v[2], v[0]) {}
  void body_loads(const BodyMotion&, Wrench& w) const override { w.force_B_N += force_B_N_; }

 private:
  Eigen::Vector3d force_B_N_;
};

constexpr EffectOption kOptions[] = {{"x_N", "N", -0.3, 0.3, 0.0}, {"y_N", "N", -0.3, 0.3, 0.0}};

}  // namespace

const EffectInfo kBodyForceBias{
    .id = "body_force_bias", .parameter = {"z_N", "N", -0.3, 0.3, 0.0}, .options = kOptions, .make = make_effect<BodyForceBias>};

}  // namespace rotorloop::sim
