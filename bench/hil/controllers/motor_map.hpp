// How motor outputs 0 to 1 of an autopilot become rotor speeds, and what a full stick means.
#pragma once

namespace rotorloop::hil {

inline constexpr double kAngleLimit_deg = 60.0;        // tilt at full stick
inline constexpr double kFullStickRate_deg_s = 200.0;  // yaw

struct MotorMap {
  double omega_min_rad_s = 0.0, omega_max_rad_s = 0.0;  // at output 0 and 1: speed follows output in a straight line
  double hover_omega_rad_s = 0.0;

  double omega_rad_s(double output) const { return omega_min_rad_s + output * (omega_max_rad_s - omega_min_rad_s); }
  double output(double omega) const { return (omega - omega_min_rad_s) / (omega_max_rad_s - omega_min_rad_s); }
};

}  // namespace rotorloop::hil
