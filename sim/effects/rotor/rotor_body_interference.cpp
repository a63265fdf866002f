// A rotor above an arm and a body feels more in-plane force than the same rotor alone: the blade-element force in the disk
// plane is multiplied by k_H. Fits of whole vehicles find about 3 (agilicious uses 3.0), isolated rotors are 1 by
// definition. The excess acts at the hub here, as no public measurement says where else; thrust and torque stay.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class RotorBodyInterference final : public Effect {
 public:
  explicit RotorBodyInterference(const EffectValues& v) : k_H_(v[0]) {}
  void rotor_loads(const RotorSite&, RotorLoads& loads) override {
    loads.force_R_N.x() *= k_H_;
    loads.force_R_N.y() *= k_H_;
  }

 private:
  double k_H_;
};

}  // namespace

const EffectInfo kRotorBodyInterference{
    .id = "rotor_body_interference", .parameter = {"k_H", "1", 1.0, 4.0, 1.0}, .options = {}, .make = make_effect<RotorBodyInterference>};

}  // namespace rotorloop::sim
