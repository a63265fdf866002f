// Drag in proportion to speed: force -d v in the body plane and -z_share d v_z along z. It stands for what the blade-element
// solve leaves of the momentum that rotors and their wakes take from the air they deflect, which grows with mass flow times
// speed; the coefficient lumps density and thrust, so it does not follow the density of the air. It dominates quadratic drag
// below d / c_xy = 9 m/s (d = 0.05 N s/m). Source: linear drag of Bangura & Mahony 2012; Kai, Allibert, Hua, Hamel 2017.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void linear_drag(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const Eigen::Vector3d d_N_s_m(v[0], v[0], v[0] * v[1]);
  w.force_B_N -= d_N_s_m.cwiseProduct(m.v_air_B_m_s);
}

constexpr EffectOption kLinearDragOptions[] = {{"z_share", "1", 0.0, 2.0, 1.0}};

}  // namespace

const EffectInfo kLinearDrag{
    .id = "linear_drag", .parameter = {"d_N_s_m", "N s/m", 0.0, 0.5, 0.0}, .options = kLinearDragOptions, .make = effect_of<linear_drag>};

}  // namespace rotorloop::sim
