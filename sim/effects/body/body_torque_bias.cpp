// A constant moment on the body, fixed in its axes: a cable that pulls, a bent arm, a motor that is not where the model has it.
// The parameter is the component about z, the options those about x and y.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void body_torque_bias(const EffectValues& v, const BodyMotion&, Wrench& w) {
  const Eigen::Vector3d moment_B_N_m(v[1], v[2], v[0]);
  w.moment_B_N_m += moment_B_N_m;
}

constexpr EffectOption kBodyTorqueBiasOptions[] = {{"x_N_m", "N m", -0.02, 0.02, 0.0}, {"y_N_m", "N m", -0.02, 0.02, 0.0}};

}  // namespace

const EffectInfo kBodyTorqueBias{.id = "body_torque_bias",
                                 .parameter = {"z_N_m", "N m", -0.02, 0.02, 0.0},
                                 .options = kBodyTorqueBiasOptions,
                                 .make = effect_of<body_torque_bias>};

}  // namespace rotorloop::sim
