// The speed that ESCs report jitters from report to report: counted commutations, uneven magnets. The rotors themselves do not
// feel it; whoever computes thrust or torque from the log does.
#include "sim/effects/plant_setup.hpp"
#include "sim/effects/system/system_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_speed_noise(const EffectValues& v, PlantSetup& setup) {
  const double sigma_rad_s = v[0];
  for (EscSetup& e : setup.esc) e.speed_noise_rad_s += sigma_rad_s;
}

}  // namespace

const EffectInfo kRotorSpeedNoise{
    .id = "rotor_speed_noise", .parameter = {"sigma_rad_s", "rad/s", 0.0, 50.0, 0.0}, .options = {}, .make = effect_of<rotor_speed_noise>};

}  // namespace rotorloop::sim
