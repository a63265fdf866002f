// The body carries the torque that speeds a rotor up: the sum of -spin * J * domega/dt about the shafts. At 1e4 rad/s^2 and
// 9.4e-6 kg m^2 it is 94 mN m, three times the aerodynamic torque of a rotor in hover, so no yaw transient is right
// without it. Source: angular momentum; Smeur, Chu, de Croon, "Adaptive incremental nonlinear dynamic inversion", 2016.
#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_inertia_reaction(const EffectValues&, const BodyMotion& m, Wrench& w) { w.moment_B_N_m -= m.rotors.H_dot_B_N_m; }

}  // namespace

// J = 0 is a rotor without inertia; 1e-4 kg m^2 is a 10-inch propeller on a large bell.
const EffectInfo kRotorInertiaReaction{.id = "rotor_inertia_reaction",
                                       .parameter = {"J_r_kg_m2", "kg m^2", 0.0, 1e-4, 0.0, ParameterOrigin::drive},
                                       .options = {},
                                       .make = effect_of<rotor_inertia_reaction>};

}  // namespace rotorloop::sim
