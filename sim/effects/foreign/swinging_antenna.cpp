// A whip antenna that swings by itself, driven by the vibration and not by the motion of the vehicle: a periodic torque about x and,
// a quarter of a period later, about y. A slung load rings when the vehicle stops; this never stops.
#include <numbers>

#include "host/base/elementary.hpp"
#include "sim/effects/foreign/foreign_list.hpp"

namespace rotorloop::sim {
namespace {

void swinging_antenna(const EffectValues& v, const BodyMotion& m, Wrench& w) {
  const double torque_N_m = v[0], frequency_Hz = v[1];
  const SinCos phase = sincos_exact(2.0 * std::numbers::pi * frequency_Hz * m.time_s);
  w.moment_B_N_m += torque_N_m * Eigen::Vector3d(phase.cos, 0.6 * phase.sin, 0.0);
}

constexpr EffectOption kForeignSwingingAntennaOptions[]{{"frequency_Hz", "Hz", 0.1, 50.0, 2.3}};

}  // namespace

const EffectInfo kForeignSwingingAntenna{.id = "foreign_swinging_antenna",
                                         .parameter = {"torque_N_m", "N m", 0.0, 0.1, 0.0},
                                         .options = kForeignSwingingAntennaOptions,
                                         .make = effect_of<swinging_antenna>};

}  // namespace rotorloop::sim
