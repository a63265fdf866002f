#include "bench/hil/controllers/betaflight_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rotorloop::hil {
namespace {

// Units of Betaflight's gains, from its documentation of the PID controller: output share per (deg/s), per deg, per (deg/s²).
constexpr double kPUnit = 0.032029e-3, kIUnit = 0.244381e-3, kDUnit = 0.000529e-3;
constexpr int kLargestGain = 250;
// Crossover of the rate loops: a motor lag of 10 ms, filters of 4 ms and a delay of 1 ms leave a phase margin of 66°.
constexpr double kRollPitchCrossover_rad_s = 28.0;
// The inertia of the rotors leads their drag: above 4 rad/s it multiplies the gain in yaw.
constexpr double kYawCrossover_rad_s = 4.0;
constexpr double kIntegralTime_s = 0.3;      // a zero at 3 rad/s, an eighth of the crossover: 7° of the margin
constexpr double kDerivativeTime_s = 0.015;  // about the motor's lag and the filters', which it cancels
constexpr double kAngleGain_1_s = 8.0;       // a third of the rate loop's crossover: damping 0.9

int gain(double value) { return std::clamp(static_cast<int>(std::lround(value)), 1, kLargestGain); }

struct Axis {
  const char* name;
  double acceleration_rad_s2;  // of the full output
  double crossover_rad_s;
  bool derivative;
};

}  // namespace

std::string betaflight_config(const host::VehicleModel& v, const MotorMap& map) {
  const double span_rad_s = map.omega_max_rad_s - map.omega_min_rad_s;
  const double thrust_slope_N =
      0.5 * v.weight_N() / map.hover_omega_rad_s * span_rad_s;  // one rotor's dT/doutput: T is k ω², a quarter of the weight
  const double torque_slope_N_m = 2.0 * v.c_q_N_m_s2 * map.hover_omega_rad_s * span_rad_s;
  double arm_x_m = 0.0, arm_y_m = 0.0;  // sums over four rotors
  for (const auto& rotor : v.rotors) {
    arm_x_m += std::fabs(rotor.position_m.x());
    arm_y_m += std::fabs(rotor.position_m.y());
  }
  const Axis axes[] = {{"roll", thrust_slope_N * arm_y_m / v.inertia_kg_m2.x(), kRollPitchCrossover_rad_s, true},
                       {"pitch", thrust_slope_N * arm_x_m / v.inertia_kg_m2.y(), kRollPitchCrossover_rad_s, true},
                       {"yaw", 4.0 * torque_slope_N_m / v.inertia_kg_m2.z(), kYawCrossover_rad_s, false}};
  std::string out =
      "set motor_pwm_protocol = PWM\nset small_angle = 180\nset gyro_calib_noise_limit = 0\nset pid_process_denom = 1\n"
      "feature -AIRMODE\nset simplified_pids_mode = OFF\nset throttle_boost = 0\nset runaway_takeoff_prevention = OFF\n";
  out += fmt::format("set min_check = {}\nset motor_idle = {}\n", kMinCheck_us, std::lround(kMotorIdle * 1e4));
  out += fmt::format("set angle_limit = {:.0f}\nset angle_p_gain = {}\nset angle_feedforward = 0\n", kAngleLimit_deg,
                     gain(10.0 * kAngleGain_1_s));
  // Equal at the centre and at the end: a straight line. Angle mode takes its angles from the same curve.
  out += "set rates_type = ACTUAL\n";
  for (const char* axis : {"roll", "pitch", "yaw"})
    out += fmt::format("set {0}_rc_rate = {1:.0f}\nset {0}_srate = {1:.0f}\nset {0}_expo = 0\n", axis, kFullStickRate_deg_s / 10.0);
  for (const Axis& a : axes) {
    const double p_share_s_deg = a.crossover_rad_s / a.acceleration_rad_s2 * std::numbers::pi / 180.0;
    out += fmt::format("set p_{0} = {1}\nset i_{0} = {2}\nset d_{0} = {3}\nset d_max_{0} = 0\nset f_{0} = 0\n", a.name,
                       gain(p_share_s_deg / kPUnit), gain(p_share_s_deg / kIntegralTime_s / kIUnit),
                       a.derivative ? gain(p_share_s_deg * kDerivativeTime_s / kDUnit) : 0);
  }
  return out + "aux 0 0 0 1700 2100 0 0\naux 1 1 1 1700 2100 0 0\nsave\n";
}

}  // namespace rotorloop::hil
