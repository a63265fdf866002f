// The controller below the planner: set-point and state estimate in, four rotor speeds out, at 1 kHz. Position after the
// paper's eq. (9), attitude after Lee et al. without torque feed-forward, speeds by the mixer. One object is constant after
// set-up (configuration, tables); what changes is ControllerState, owned by the caller. No heap, no clock, no exceptions.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "host/control/attitude.hpp"
#include "host/control/effect_feed_forward.hpp"
#include "host/control/mixer.hpp"
#include "host/control/setpoint.hpp"
#include "host/estimate/samples.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

// The three controllers that the paper compares, and the last of them without what diagnosis added; gains are the same in all.
enum class Variant : std::uint8_t {
  pd_ff,              // no drag compensation, c_t of still air
  pd_ff_drag,         // eq. (9), c_t of still air
  pd_ff_thrust_drag,  // eq. (9), c_t of the flight state, the vehicle's added terms; without such terms it is the paper's third
  pd_ff_no_effects,   // the same without the added terms
};
std::string_view name(Variant variant);
// False when the word names no variant.
bool parse(std::string_view word, Variant& variant);

// Second-order behaviour wanted of one group of axes: natural frequency and damping ratio.
struct AxisGains {
  double frequency_rad_s = 0.0;
  double damping = 1.0;
  double kp() const { return frequency_rad_s * frequency_rad_s; }  // 1/s²
  double kd() const { return 2.0 * damping * frequency_rad_s; }    // 1/s
};

struct Gains {
  AxisGains horizontal, vertical, roll_pitch, yaw;
};

struct ThrustLimits {
  double tilt_max_rad = 1.13;        // 65°: 10.8 m/s² and drag at 8.5 m/s need 53°
  double vertical_min_weight = 0.2;  // least vertical thrust, as a share of the weight: never aims downwards
  double total_max_weight = 3.3;     // most thrust, as a multiple of the weight
};

// The reaction leads the drag torque by J / (2 c_q ω), 0.16 to 0.29 s for 5-inch rotors. Cancelling all of it would leave no
// phase margin when the reaction is weaker than in the nominal model; up to this much leaves 37° then and 60° with the whole of it.
inline constexpr double kYawShapingMax_s = 0.05;

// Whose velocity feeds the drag compensation (decision 0042).
enum class DragVelocity : std::uint8_t { setpoint, estimate };

struct ControllerConfig {
  Gains gains;
  ThrustLimits limits;
  Variant variant = Variant::pd_ff_thrust_drag;
  DragVelocity drag_velocity = DragVelocity::estimate;
  ThrustLookup thrust_lookup = ThrustLookup::full;  // for pd_ff_thrust_drag and _no_effects; the others use still air
  bool rotor_local_velocity = true;
  // Yaw torque comes from the propellers' drag and, while they change speed, from their inertia: a speed change gives J dω/dt
  // at once and c_q ω² later. True: the mixer's yaw demand is softened for it (decision 0047). False: only to show the
  // damage, a yaw loop that shakes the rotors.
  bool rotor_reaction = true;
  VehicleTerms terms;      // of the vehicle file; used by pd_ff_thrust_drag
  double period_s = 1e-3;  // of step()
  double omega_min_rad_s = MixerConfig{}.omega_min_rad_s;
  double omega_max_rad_s = MixerConfig{}.omega_max_rad_s;
};

// What held the controller back in one step.
struct Limiters {
  bool tilt = false;
  bool thrust = false;  // by ThrustLimits or by the rotors
  bool roll_pitch = false;
  bool yaw = false;
  bool table_edge = false;
  bool direction_held = false;  // near free fall: no thrust direction to point to
  friend bool operator==(const Limiters&, const Limiters&) = default;
};

struct Diagnostics {
  Eigen::Vector3d thrust_W_N = Eigen::Vector3d::Zero();  // eq. (9) after limits
  Eigen::Quaterniond q_WB_sp = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_B_sp_rad_s = Eigen::Vector3d::Zero();
  double thrust_B_N = 0.0;  // demanded of the mixer
  Eigen::Vector3d torque_B_N_m = Eigen::Vector3d::Zero();
  int mixer_iterations = 0;
  double mixer_residual_rad_s = 0.0;
  Eigen::Vector3d effect_force_B_N = Eigen::Vector3d::Zero();  // of the added terms, countered by thrust and attitude
  double effect_thrust_N = 0.0;                                // by which the mixer's demand was raised for them
  int effect_rounds = 0;
  Limiters limiters;
  bool bad_input = false;         // not finite: the last good command was repeated (hover speeds when there is none)
  bool estimate_invalid = false;  // position feedback was off: level attitude, weight as thrust
};

// What became of the question to the controller in this step.
enum class Answer : std::uint8_t {
  usable,
  refused,  // not usable: the last good command is repeated
  held,     // not asked in this step: the last answer holds
};

struct Command {
  std::array<double, kRotors> omega_rad_s{};
  Diagnostics diagnostics;
  Answer answer = Answer::usable;
  std::optional<StateEstimate> estimate;  // the controller's own, when it does not use the flight computer's
};

// What an attitude-level controller asks of the loops below it.
struct AttitudeDemand {
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d w_B_rad_s = Eigen::Vector3d::Zero();  // in the axes of q_WB
  double thrust_B_N = 0.0;                              // all rotors, along +z of B
};

struct ControllerCounters {
  std::uint64_t steps = 0;
  std::uint64_t bad_input = 0;
  std::uint64_t estimate_invalid = 0;
  std::uint64_t mixer_not_converged = 0;
  std::uint64_t limited = 0;  // steps in which any limiter acted
  // Steps in which the added terms, if the vehicle has any, were left out for want of a valid estimate; gave no number, so that
  // eq. (1)-(5) flew; were cut to kEffectShare; or left the speeds more than their tolerance from the demand.
  std::uint64_t effects_off = 0, effects_not_finite = 0, effects_bounded = 0, effects_not_converged = 0;
};

struct ControllerState {
  bool started = false;
  std::array<double, kRotors> omega_rad_s{};  // last good command
  double yaw_torque_N_m = 0.0;                // by the propellers' drag alone, last demand
  Heading heading;                            // last good attitude set-point, for the singular cases
  ControllerCounters counters;
};

class Controller {
 public:
  Controller(const VehicleModel& vehicle, const ControllerConfig& config);
  // One control period: rotor speeds (rad/s, rotors 1 to 4) for the set-point and estimate of one instant, both in W, z up. To be called
  // every period_s; never throws or allocates, and answers input that is not finite with the last good command.
  Command step(ControllerState& state, const StateEstimate& estimate, const Setpoint& setpoint) const;
  // The lower half alone, for an attitude from elsewhere: attitude loop and mixer; the vehicle's added terms are not used. Input that is
  // not finite is answered as by step().
  Command follow(ControllerState& state, const StateEstimate& estimate, const AttitudeDemand& demand) const;
  const ControllerConfig& config() const { return config_; }
  double hover_omega_rad_s() const { return mixer_.hover_omega_rad_s(); }

 private:
  Eigen::Vector3d wanted_thrust_W_N(const StateEstimate& estimate, const Setpoint& setpoint, const Eigen::Vector3d& effect_force_B_N,
                                    Limiters& limiters) const;
  void begin(ControllerState& state) const;
  // The last good command, or hover speeds when there is none.
  void repeat_last(ControllerState& state, Command& out) const;
  void shape_torque(ControllerState& state, const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& w_B_rad_s, const AttitudeSetpoint& attitude,
                    Diagnostics& d) const;

  VehicleModel vehicle_;
  ControllerConfig config_;
  Mixer mixer_;
  EffectFeedForward effects_;
  double yaw_shaping_s_;
};

}  // namespace rotorloop::host
