// A ceiling close above starves the disk of air from straight above; the flow comes in from the side, the pressure over the disk
// drops and the vehicle is sucked up:  T = T_free / (1 - gain (R / 4g)^2 / (1 + (V / v_i)^2)),  g gap from hub to ceiling.
// It is the ground's formula mirrored; no coefficient is established for it, so gain is to be fitted.
// 6.7 % at one radius of gap, 1.6 % at two, nothing to speak of beyond. Held below half a radius; above the ceiling is free air.
// Source: Powers, Mellinger, Kushleyev, Kothmann, Kumar 2013; Sanchez-Cuevas, Heredia, Ollero 2017.
#include <algorithm>

#include "sim/effects/rotor/rotor_list.hpp"
#include "sim/effects/rotor/wake.hpp"

namespace rotorloop::sim {
namespace {

void ceiling_effect(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double gain = v[0], ceiling_z_m = v[1];
  const double gap_m = ceiling_z_m - s.hub_W_m.z(), R = s.rotor->radius_m();
  if (gap_m < 0.0) return;
  const double image = R / (4.0 * std::max(gap_m, 0.5 * R));
  loads.force_R_N.z() /= 1.0 - gain * image * image * wake_below(s);
}

constexpr EffectOption kCeilingEffectOptions[]{{"ceiling_z_m", "m", -100.0, 1000.0, 3.0}};

}  // namespace

const EffectInfo kCeilingEffect{
    .id = "ceiling_effect", .parameter = {"gain", "1", 0.0, 2.0, 0.0}, .options = kCeilingEffectOptions, .make = effect_of<ceiling_effect>};

}  // namespace rotorloop::sim
