// The side force of a rotor in edgewise flow: coning and stiff blades lean the disk across the wind, to the left of its motion
// for a counter-clockwise rotor with k_l > 0, to the right for a clockwise one: force spin k_l omega (e_z x v_xy). Over four
// equal rotors it cancels; a yaw torque in forward flight uncovers it. A disk that leans 0.44 degrees at 15 m/s, as a stiff
// three-blade propeller does, is k_l = 0.9e-6 N s^2/m at 1.7 N and 945 rad/s; it lumps the density and does not follow it. Source:
// first-harmonic flapping, sine term.
#include "sim/effects/rotor/rotor_list.hpp"

namespace rotorloop::sim {
namespace {

void lateral_flapping(const EffectValues& v, const RotorSite& s, RotorLoads& loads) {
  const double k_l_N_s2_m = v[0];
  const double per_speed_N_s_m = s.condition.spin * s.condition.omega_rad_s * k_l_N_s2_m;
  loads.force_R_N.x() -= per_speed_N_s_m * s.condition.v_R_m_s.y();
  loads.force_R_N.y() += per_speed_N_s_m * s.condition.v_R_m_s.x();
}

}  // namespace

const EffectInfo kLateralFlapping{
    .id = "lateral_flapping", .parameter = {"k_l_N_s2_m", "N s^2/m", -1e-5, 1e-5, 0.0}, .options = {}, .make = effect_of<lateral_flapping>};

}  // namespace rotorloop::sim
