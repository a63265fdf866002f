// A roll moment that grows with the product of yaw rate and forward speed, as of a fin far from the centre of mass whose wake turns with
// the vehicle: neither factor alone has it, and turns at rest and straight passes are free of it.
#include "sim/effects/foreign/foreign_list.hpp"

namespace rotorloop::sim {
namespace {

void product_moment(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  w.moment_B_N_m.x() += v[0] * m.w_B_rad_s.z() * m.v_air_B_m_s.x();
}

}  // namespace

const EffectInfo kForeignProductMoment{
    .id = "foreign_product_moment", .parameter = {"k_N_s2", "N s^2", -0.1, 0.1, 0.0}, .options = {}, .make = effect_of<product_moment>};

}  // namespace rotorloop::sim
