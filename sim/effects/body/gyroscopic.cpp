// Turning the body turns the angular momentum of its rotors: moment -Omega x sum(spin * J * omega) on the body. It cancels
// over four equal speeds and shows under yaw torque, when the speeds of the two pairs differ.
// Source: Euler's equation for a body with spinning parts; Sun, de Visser, Chu 2019, eq. (5).
#include <Eigen/Geometry>

#include "sim/effects/body/body_list.hpp"

namespace rotorloop::sim {
namespace {

void gyroscopic(const EffectValues&, const BodyMotion& m, Wrench& w) { w.moment_B_N_m -= m.w_B_rad_s.cross(m.rotors.H_B_N_m_s); }

}  // namespace

const EffectInfo kGyroscopic{.id = "gyroscopic",
                             .parameter = {"J_r_kg_m2", "kg m^2", 0.0, 1e-4, 0.0, ParameterOrigin::drive},
                             .options = {},
                             .make = effect_of<gyroscopic>};

}  // namespace rotorloop::sim
