// Thrust does not grow with exactly the square of speed: Reynolds numbers rise, blades twist, tips near the speed of sound.
// T (omega / omega_0)^exponent leaves the thrust at omega_0 alone. What the polars of the solve give (Reynolds) is already in;
// this is what they leave out. Measured: C_T up 9 % from 1 400 to 7 000 rpm (exponent 0.05), k_T of a 5136 propeller
// 0.76 to 1.03e-6 N s^2 from 3 900 rpm up, then down to 0.94e-6 at 28 500. Torque stays. Source: UIUC data base; ARK bench data.
#include <algorithm>

#include "host/base/elementary.hpp"
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

constexpr double kLeastRatio = 0.05;  // of omega_0: below, there is no thrust to speak of, and a power law has no say

void thrust_speed_exponent(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double exponent = v[0], omega_0_rad_s = v[1];
  loads.force_R_N.z() *= pow_exact(std::max(s.condition.omega_rad_s / omega_0_rad_s, kLeastRatio), exponent);
}

constexpr EffectOption kThrustSpeedExponentOptions[]{{"omega_0_rad_s", "rad/s", 100.0, 5000.0, 945.0}};

}  // namespace

const EffectInfo kThrustSpeedExponent{.id = "thrust_speed_exponent",
                                      .parameter = {"exponent", "1", -0.5, 0.5, 0.0},
                                      .options = kThrustSpeedExponentOptions,
                                      .make = effect_of<thrust_speed_exponent>};

}  // namespace rotorloop::sim
