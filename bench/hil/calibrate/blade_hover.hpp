// What a blade says of hover: speed, thrust and torque coefficient at a given thrust, by the BEM rotor model in still air.
#pragma once
#include "sim/rotor/blade.hpp"

namespace rotorloop::calibrate {

struct BladeHover {
  double omega_rad_s = 0.0;
  double c_t_N_s2 = 0.0, c_q_N_m_s2 = 0.0;
  double tip_speed_m_s = 0.0;
  double shaft_power_W = 0.0;
};

// Throws Error where the blade's tip would pass Mach 0.6 before it carries `thrust_N`.
BladeHover blade_hover(const sim::Blade& blade, double thrust_N, double density_kg_m3);

// Geometric pitch at 0.75 of the radius, m: what is printed on a propeller, as its blade has it.
double blade_pitch_m(const sim::Blade& blade);

}  // namespace rotorloop::calibrate
