// The strut under a rotor stands in its wake and takes part of the thrust back: thrust * (1 - loss). The seed paper sees
// 8 % between flight and a stand without struts (section V-B); arms of 6, 15 and 22 mm cost 0, 1.7 and 5 % on a bench.
// Shaft torque and in-plane force stay: the momentum that the strut catches has already been paid for by the shaft.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void blockage_strut(const EffectValues& v, const RotorSite&, RotorLoads& loads) {
  const double loss = v[0];
  loads.force_R_N.z() *= 1.0 - loss;
}

}  // namespace

const EffectInfo kBlockageStrut{
    .id = "blockage_strut", .parameter = {"loss", "1", 0.0, 0.3, 0.0}, .options = {}, .make = effect_of<blockage_strut>};

}  // namespace rotorloop::sim
