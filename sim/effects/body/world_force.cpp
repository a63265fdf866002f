// A thread from the centre of mass to a spring reel far away: its tension is the same wherever the vehicle is, and so is its direction.
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void world_force(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double tension_N = v[0];
  const SinCos towards = sincos_exact(v[1] * std::numbers::pi / 180.0);
  const Eigen::Vector3d along_W(towards.cos, towards.sin, 0.0);
  w.force_B_N += m.R_WB.transpose() * (tension_N * along_W);
}

constexpr EffectOption kWorldForceOptions[]{{"towards_deg", "deg", -360.0, 360.0, 0.0}};

}  // namespace

const EffectInfo kWorldForce{
    .id = "world_force", .parameter = {"force_N", "N", 0.0, 2.0, 0.0}, .options = kWorldForceOptions, .make = effect_of<world_force>};

}  // namespace rotorloop::sim
