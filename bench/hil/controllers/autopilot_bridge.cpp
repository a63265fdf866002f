#include "bench/hil/controllers/autopilot_bridge.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/base/error.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::hil {
namespace {

constexpr int kMostMissed = 40;  // states in a row without motor outputs: 4 s of waiting
constexpr double kDeg_per_rad = 180.0 / std::numbers::pi;
// The pilot: a sixth of the attitude loop's 15 rad/s (angle gain 8 1/s over a rate crossover of 28 rad/s), and a slow trim of the throttle,
// because a stick is no thrust: a fifth of the vertical loop's frequency.
constexpr double kPilot_rad_s = 2.5, kPilotDamping = 0.9, kTrim_1_s3 = 1.2, kMostTrimWeight = 0.25;
constexpr double kPilotTilt_rad = 0.7, kPilotYaw_1_s = 2.0;

host::ControllerConfig pilot_config(const BridgeFiles& f) {
  host::ControllerConfig c = host::controller_config(f.gains, host::Variant::pd_ff_drag);
  c.gains.horizontal = c.gains.vertical = {kPilot_rad_s, kPilotDamping};
  c.limits.tilt_max_rad = kPilotTilt_rad;
  c.period_s = 1e-3 * kStepsPerStick;
  return c;
}

// Our position loop as a pilot in angle mode: roll and pitch are angles, throttle is thrust, yaw is a rate.
class Pilot {
 public:
  explicit Pilot(const BridgeFiles& f)
      : map_(f.map), weight_N_(f.vehicle.weight_N()), mass_kg_(f.vehicle.mass_kg), loop_(f.vehicle, pilot_config(f)) {}

  PilotCommand wish(const rotorloop_controller_input& in) {
    PilotCommand s;
    s.flying = in.phase == ROTORLOOP_PHASE_FLYING;
    s.arm = in.t_s >= kAutopilotArm_s && in.phase != ROTORLOOP_PHASE_SAFE;
    if (!s.flying) return s;
    const double* q = in.estimate_q_WB;
    const host::StateEstimate estimate{.time_us = std::llround(in.t_s * 1e6),
                                       .p_W_m = vector(in.estimate_p_W_m),
                                       .v_W_m_s = vector(in.estimate_v_W_m_s),
                                       .q_WB = Eigen::Quaterniond(q[0], q[1], q[2], q[3]),
                                       .w_B_rad_s = vector(in.estimate_w_B_rad_s),
                                       .valid = in.estimate_valid != 0};
    host::Setpoint setpoint;
    setpoint.p_W_m = vector(in.setpoint_p_W_m);
    setpoint.v_W_m_s = vector(in.setpoint_v_W_m_s);
    setpoint.a_W_m_s2 = vector(in.setpoint_a_W_m_s2);
    setpoint.yaw_rad = in.setpoint_yaw_rad;
    if (in.t_s >= kAutopilotStart_s) {  // on the stand an error of height says nothing
      const double error_m = setpoint.p_W_m.z() - estimate.p_W_m.z(), most = kMostTrimWeight * weight_N_ / mass_kg_;
      trim_m_s2_ = std::clamp(trim_m_s2_ + kTrim_1_s3 * error_m * 1e-3 * kStepsPerStick, -most, most);
    }
    setpoint.a_W_m_s2.z() += trim_m_s2_;
    wanted_ = loop_.step(state_, estimate, setpoint).diagnostics;
    const Eigen::Matrix3d R = wanted_.q_WB_sp.toRotationMatrix();
    s.roll_deg = kDeg_per_rad * std::atan2(R(2, 1), R(2, 2));
    s.pitch_deg = kDeg_per_rad * std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
    const Eigen::Matrix3d B = estimate.q_WB.toRotationMatrix();
    const double off_rad = std::remainder(in.setpoint_yaw_rad - std::atan2(B(1, 0), B(0, 0)), 2.0 * std::numbers::pi);
    s.yaw_left_deg_s = kDeg_per_rad * (kPilotYaw_1_s * off_rad + in.setpoint_yaw_rate_rad_s);
    // Thrust goes with the square of the speed.
    s.thrust_share = map_.output(map_.hover_omega_rad_s * std::sqrt(wanted_.thrust_B_N / weight_N_));
    return s;
  }
  const host::Diagnostics& wanted() const { return wanted_; }

 private:
  MotorMap map_;
  double weight_N_, mass_kg_, trim_m_s2_ = 0.0;
  host::Controller loop_;
  host::ControllerState state_;
  host::Diagnostics wanted_;
};

// What a flight log of the autopilot would note, on standard error with the time.
class Notes {
 public:
  void add(const rotorloop_controller_input& in, const std::array<float, 4>& motors, const MotorMap& map) {
    const bool turning = std::any_of(motors.begin(), motors.end(), [](float m) { return m > 0.0f; });
    if (turning && !armed_) note(in, "armed: motor outputs above zero");
    if (!turning && armed_) note(in, "disarmed: motor outputs at zero");
    armed_ = turning;
    for (std::size_t i = 0; i < 4; ++i) {
      const double wanted = map.omega_rad_s(motors[i]), speed = in.omega_rad_s[i];
      still_[i] = speed == last_[i] ? still_[i] + 1 : 0;  // a measured speed is never the same twice
      last_[i] = speed;
      const bool lost = turning && in.phase >= ROTORLOOP_PHASE_FLYING && (still_[i] >= kStillSteps || !(speed > kLostShare * wanted));
      if (lost && !lost_[i] && still_[i] >= kStillSteps)
        note(in, fmt::format("ESC {}: no new speed for {} ms, the motor output asks for {:.0f} rad/s", i + 1, still_[i], wanted));
      else if (lost && !lost_[i])
        note(in, fmt::format("ESC {} reports {:.0f} rad/s where the motor output asks for {:.0f} rad/s", i + 1, speed, wanted));
      lost_[i] = lost;
    }
    if (in.phase != phase_) note(in, fmt::format("flight computer: {}", kPhaseNames[in.phase]));
    phase_ = in.phase;
  }

 private:
  static constexpr int kStillSteps = 20;     // 1 ms each; the flight computer gives an ESC up after 30 ms without a frame
  static constexpr double kLostShare = 0.5;  // a motor catches up with any command of a flight to half of it within a step or two
  static constexpr std::array<const char*, 4> kPhaseNames{"boot", "spin_up", "flying", "safe, sticks to zero and disarm"};
  static void note(const rotorloop_controller_input& in, const std::string& what) { fmt::print(stderr, "{:.3f} s: {}\n", in.t_s, what); }
  bool armed_ = false;
  std::uint32_t phase_ = ROTORLOOP_PHASE_BOOT;
  std::array<bool, 4> lost_{};
  std::array<double, 4> last_{};
  std::array<int, 4> still_{};
};

// A folder that goes with the flight's logs, or a temporary one.
std::filesystem::path work_folder(const std::string& name, const std::string& log_folder) {
  if (!log_folder.empty()) return log_folder;
  std::string pattern = (std::filesystem::temp_directory_path() / ("rotorloop-" + name + "-XXXXXX")).string();
  if (!mkdtemp(pattern.data())) throw Error({pattern, "cannot be made", "", "free space in the temporary folder"}, ExitCode::device);
  return pattern;
}

std::string one_line(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') out += ';';
    if (c != '\n' && !(c == ' ' && out.ends_with(' '))) out += c;
  }
  return out;
}

void say(const std::string& line) { std::cout << line << std::flush; }

rotorloop_controller_output answer(const BridgeFiles& f, const Pilot& pilot, const std::array<float, 4>& motors) {
  rotorloop_controller_output out = empty_output();
  for (std::size_t i = 0; i < 4; ++i) out.omega_rad_s[i] = f.map.omega_rad_s(std::clamp(static_cast<double>(motors[i]), 0.0, 1.0));
  const Eigen::Quaterniond& q = pilot.wanted().q_WB_sp;
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  std::copy(wxyz.begin(), wxyz.end(), out.q_WB);
  out.thrust_N = pilot.wanted().thrust_B_N;
  return out;
}

void fly(const AutopilotBridge& bridge, const BridgeFiles& f, AutopilotLink& link) {
  Pilot pilot(f);
  PilotCommand wish;
  Notes notes;
  std::array<float, 4> motors{};
  int missed = 0;
  std::uint64_t states = 0, unanswered = 0;
  std::string line;
  rotorloop_controller_input in{};
  const std::string see = std::string("see ") + bridge.log;
  while (std::getline(std::cin, line)) {
    if (const auto why = parse_input(line, in); !why.empty())
      throw Error({"handshake", why, "", "use the rotorloop that started this bridge"});
    if (states == 0) link.synchronize(in);  // only now: each answer has a wait of its own
    if (in.step % kStepsPerStick == 0) wish = pilot.wish(in);
    missed = link.exchange(in, wish, motors) ? 0 : missed + 1;
    ++states;
    unanswered += missed > 0;
    if (missed > 0 && !link.running()) throw Error({bridge.name, "its program has ended", "", see}, ExitCode::device);
    if (missed > kMostMissed)
      throw Error({bridge.name, fmt::format("no motor packet for {} states", missed), "it hangs", see}, ExitCode::device);
    notes.add(in, motors, f.map);
    say(output_line(in.step, answer(f, pilot, motors)));
  }
  fmt::print(stderr, "{} states, {} of them without an answer within {} ms\n", states, unanswered, bridge.wait_ms);
}

}  // namespace

BridgeFiles read_bridge_files(const std::filesystem::path& vehicle_file, const std::filesystem::path& gains_file) {
  BridgeFiles f{host::to_model(host::read_vehicle(vehicle_file, host::builtin_effect_catalogue())), host::read_gains(gains_file), {}};
  const host::Controller c(f.vehicle, host::controller_config(f.gains, host::Variant::pd_ff));
  f.map = {f.gains.omega_min_rad_s, f.gains.omega_max_rad_s, c.hover_omega_rad_s()};
  return f;
}

std::filesystem::path autopilot_program(const char* name, const char* variable) {
  const char* path = std::getenv(variable);
  if (!path || !*path)
    throw Error({variable, "is not set", "", fmt::format("set it to the path of the simulator program of {} (docs/controller.md)", name)},
                ExitCode::device);
  if (!std::filesystem::is_regular_file(path))
    throw Error(
        {variable, fmt::format("\"{}\": no such file", path), "", fmt::format("give the path of the simulator program of {}", name)},
        ExitCode::device);
  return std::filesystem::absolute(path);
}

int serve_autopilot(const AutopilotBridge& bridge) {
  std::string line;
  HandshakeSetup setup;
  if (!std::getline(std::cin, line)) return 1;
  bool greeted = false;
  try {
    if (const auto why = parse_setup(line, setup); !why.empty())
      throw Error({"handshake", why, "", "use the rotorloop that started this bridge"});
    const BridgeFiles f = read_bridge_files(setup.vehicle_file, setup.gains_file);
    const auto link = bridge.start(f, autopilot_program(bridge.name, bridge.variable), work_folder(bridge.name, setup.log_folder));
    say(hello_line({.level = ROTORLOOP_LEVEL_ROTOR_SPEED, .every = 1, .own_estimate = false, .start_s = kAutopilotStart_s}));
    greeted = true;
    fly(bridge, f, *link);
  } catch (const Error& e) {
    fmt::print(stderr, "{}\n", one_line(e.what()));  // the run shows the last line
    if (!greeted) say(nlohmann::json{{"error", e.what()}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return to_int(e.exit_code());
  }
  return 0;
}

}  // namespace rotorloop::hil
