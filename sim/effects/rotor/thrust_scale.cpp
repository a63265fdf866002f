// A batch of propellers differs from the one that was measured: chord, pitch and finish scale the thrust of all four rotors at the
// same speed. with_torque = 1 scales the shaft torque alike (more chord); 0 leaves it (a stand whose thrust was misread).
// Source: spread of one product between stands: thrust coefficients of a 5-inch propeller within 0.76 to 1.03e-6 N s^2.
#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/what_if.hpp"

namespace rotorloop::sim {
namespace {

void thrust_scale(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double scale = v[0];
  const bool with_torque(v[1] != 0.0);
  loads.force_R_N.z() *= scale;
  if (with_torque) add_shaft_torque(loads, s.condition.spin, (scale - 1.0) * loads.shaft_torque_N_m);
}

constexpr EffectOption kThrustScaleOptions[]{{"with_torque", "1", 0.0, 1.0, 0.0, true}};

}  // namespace

const EffectInfo kThrustScale{
    .id = "thrust_scale", .parameter = {"scale", "1", 0.7, 1.3, 1.0}, .options = kThrustScaleOptions, .make = effect_of<thrust_scale>};

}  // namespace rotorloop::sim
