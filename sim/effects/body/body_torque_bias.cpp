// A constant moment on the body, fixed in its axes: a cable that pulls, a bent arm, a motor that is not where the model has it.
// The parameter is the component about z, the options those about x and y.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

class BodyTorqueBias final : public Effect {
 public:
  explicit BodyTorqueBias(const EffectValues& v) : moment_B_N_m_(v[1], v[2], v[0]) {}
  void body_loads(const BodyMotion&, Wrench& w) const override { w.moment_B_N_m += moment_B_N_m_; }

 private:
  Eigen::Vector3d moment_B_N_m_;
};

constexpr EffectOption kOptions[] = {{"x_N_m", "N m", -0.02, 0.02, 0.0}, {"y_N_m", "N m", -0.02, 0.02, 0.0}};

}  // namespace

const EffectInfo kBodyTorqueBias{
    .id = "body_torque_bias", .parameter = {"z_N_m", "N m", -0.02, 0.02, 0.0}, .options = kOptions, .make = make_effect<BodyTorqueBias>};

}  // namespace rotorloop::sim
