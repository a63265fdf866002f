// A constant force on the body, fixed in its axes: what is left when nothing physical explains a force that neither speed nor
// thrust changes. Honest only as a last resort, so the plant has it to teach diagnosis the difference. The parameter is the
// component along z, the options those along x and y.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void body_force_bias(const EffectValues& v, const BodyMotion&, Wrench& w) {
  const Eigen::Vector3d force_B_N(v[1], v[2], v[0]);
  w.force_B_N += force_B_N;
}

constexpr EffectOption kBodyForceBiasOptions[] = {{"x_N", "N", -0.3, 0.3, 0.0}, {"y_N", "N", -0.3, 0.3, 0.0}};

}  // namespace

const EffectInfo kBodyForceBias{.id = "body_force_bias",
                                .parameter = {"z_N", "N", -0.3, 0.3, 0.0},
                                .options = kBodyForceBiasOptions,
                                .make = effect_of<body_force_bias>};

}  // namespace rotorloop::sim
