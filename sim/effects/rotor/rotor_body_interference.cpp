// A rotor above an arm and a body feels more in-plane force than the same rotor alone: the blade-element force in the disk
// plane is multiplied by k_H. Fits of whole vehicles find about 3 (agilicious uses 3.0), isolated rotors are 1 by
// definition. The excess acts at the hub here, as no public measurement says where else; thrust and torque stay.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_body_interference(const EffectValues& v, const RotorSite&, RotorLoads& loads) {
  const double k_H = v[0];
  loads.force_R_N.x() *= k_H;
  loads.force_R_N.y() *= k_H;
}

}  // namespace

const EffectInfo kRotorBodyInterference{
    .id = "rotor_body_interference", .parameter = {"k_H", "1", 1.0, 4.0, 1.0}, .options = {}, .make = effect_of<rotor_body_interference>};

}  // namespace rotorloop::sim
