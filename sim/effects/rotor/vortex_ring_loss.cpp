// Descending into its own wake a rotor recirculates it: the mean thrust at the same speed drops, T (1 - loss b). The ring bump b is 1
// in descent at the hover induced velocity v_h and 0 outside 0.3 to 1.7 v_h, or once edgewise flow has blown the ring away.
// It comes on top of the empirical inflow of the solve, a fit of measurements of isolated helicopter rotors in steady descent:
// what four small rotors beside each other lose more than those is the loss. Torque stays. Source: Johnson, NASA TP-2005-213477.
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

void vortex_ring_loss(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double loss = v[0];
  loads.force_R_N.z() *= 1.0 - loss * ring_state(s);
}

}  // namespace

const EffectInfo kVortexRingLoss{
    .id = "vortex_ring_loss", .parameter = {"loss", "1", 0.0, 0.4, 0.0}, .options = {}, .make = effect_of<vortex_ring_loss>};

}  // namespace rotorloop::sim
