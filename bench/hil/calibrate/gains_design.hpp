// Gains of a vehicle from its model and its actuators: the fastest loops that keep the margins below. Nothing is flown here; the
// margins are those of linear loops around hover, the plant a double integrator behind a rotor's lag and the delays of the loop.
#pragma once
#include <string>

#include "host/control/gains_file.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::calibrate {

// What stands between a torque that the controller asks for and the torque that acts.
struct ActuatorDynamics {
  double lag_s = 0.010;          // a rotor's speed follows its set-point as a first-order lag of this time constant
  double delay_s = 0.003;        // from a rate that is sensed to a set-point that an ESC has: gyro, controller step, bus
  double omega_max_rad_s = 0.0;  // highest speed that is to be commanded
};

// What every loop keeps.
inline constexpr double kLeastPhase_deg = 45.0;  // roll, pitch, yaw: a rotor half again as slow is then still damped
inline constexpr double kLeastGainFactor =
    3.0;  // the loop gain may rise by this before it oscillates: thrust and inertia are known to 30 %
inline constexpr double kLeastOuterPhase_deg = 60.0;  // position: its poses are late and noisy besides
inline constexpr double kLoopSeparation = 5.5;        // attitude over position; below 4 they fight (gains_file.hpp)
inline constexpr double kStep_rad = 0.26;             // 15 degrees of attitude error are answered within the rotors' torque in hover

struct LoopMargins {
  double crossover_rad_s = 0.0;  // highest frequency at which the loop gain is 1
  double phase_deg = 0.0;        // phase left there
  double gain_factor = 0.0;      // by which the gain may rise; infinite when the phase never crosses -180 degrees
};

struct DesignedLoop {
  host::AxisGains gains;
  LoopMargins margins;
  const char* limited_by = "";  // "phase margin", "gain margin", "torque in hover" …
};

struct GainsDesign {
  host::GainsFile file;
  DesignedLoop horizontal, vertical, roll_pitch, yaw;
  double hover_rad_s = 0.0, thrust_to_weight = 0.0;  // by the vehicle's own thrust model in still air
};

// Margins of an attitude axis: PD over a double integrator behind lag and delay. `lead_s`: the reaction of rotors that spin up multiplies a
// yaw torque by 1 + lead s, and `shaping_s` is how the controller softens it (decision 0047); zero for roll and pitch.
LoopMargins attitude_margins(const host::AxisGains& gains, const ActuatorDynamics& actuators, double lead_s = 0.0, double shaping_s = 0.0);

// Of a horizontal axis of position: PD over a double integrator behind the closed loop of roll and pitch.
LoopMargins position_margins(const host::AxisGains& gains, const host::AxisGains& roll_pitch, const ActuatorDynamics& actuators);

// Throws Error when the speed limit leaves no thrust to climb and steer with (1.3 times the weight), or an input is out of range.
GainsDesign design_gains(const host::VehicleModel& vehicle, const ActuatorDynamics& actuators);

// A gains.toml with the margins as comments.
std::string gains_text(const GainsDesign& design, const std::string& vehicle_name, const ActuatorDynamics& actuators);

}  // namespace rotorloop::calibrate
