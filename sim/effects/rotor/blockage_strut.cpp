// The strut under a rotor stands in its wake and takes part of the thrust back: thrust * (1 - loss). The seed paper sees
// 8 % between flight and a stand without struts (section V-B); arms of 6, 15 and 22 mm cost 0, 1.7 and 5 % on a bench.
// Shaft torque and in-plane force stay: the momentum that the strut catches has already been paid for by the shaft.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

class BlockageStrut final : public Effect {
 public:
  explicit BlockageStrut(const EffectValues& v) : loss_(v[0]) {}
  void rotor_loads(const RotorSite&, RotorLoads& loads) override { loads.force_R_N.z() *= 1.0 - loss_; }

 private:
  double loss_;
};

}  // namespace

const EffectInfo kBlockageStrut{
    .id = "blockage_strut", .parameter = {"loss", "1", 0.0, 0.3, 0.0}, .options = {}, .make = make_effect<BlockageStrut>};

}  // namespace rotorloop::sim
