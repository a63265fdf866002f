// The advancing side of a rotor lifts more than the retreating one: moment -spin omega mu_R v_xy on the hub, which lowers the
// retreating side. It comes on top of the hub moment of the blade-element model, for rotors that show more of it; over the
// four rotors it cancels unless their speeds differ. Size: mu_R = 1e-6 N s^2 gives 8 mN m per rotor at 8.5 m/s and 945 rad/s.
// mu_R lumps the density and does not follow it.
// Source: the rolling-moment term of RotorS (Furrer et al. 2016); Kai, Allibert, Hua, Hamel 2017, eq. (7).
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void rotor_rolling_moment(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double mu_R_N_s2 = v[0];
  const double per_speed_N_s = s.condition.spin * s.condition.omega_rad_s * mu_R_N_s2;
  loads.moment_R_N_m.head<2>() -= per_speed_N_s * s.condition.v_R_m_s.head<2>();
}

}  // namespace

const EffectInfo kRotorRollingMoment{.id = "rotor_rolling_moment",
                                     .parameter = {"mu_R_N_s2", "N s^2", 0.0, 5e-6, 0.0},
                                     .options = {},
                                     .make = effect_of<rotor_rolling_moment>};

}  // namespace rotorloop::sim
