#include "bench/hil/controller/betaflight_bridge.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "bench/hil/controller/betaflight_config.hpp"
#include "bench/hil/controller/betaflight_link.hpp"
#include "bench/hil/controller/handshake.hpp"
#include "host/base/error.hpp"
#include "host/control/gains_file.hpp"
#include "host/vehicle/vehicle_file.hpp"

namespace rotorloop::hil {
namespace {

constexpr double kArm_s = 5.5;                // Betaflight starts and calibrates until 5 s of its time
constexpr double kStart_s = 8.0;              // of the trajectory
constexpr std::uint64_t kStepsPerStick = 10;  // 100 Hz, as a radio link sends
constexpr int kMostMissed = 40;               // states in a row without a motor packet: 4 s of waiting
constexpr double kDeg_per_rad = 180.0 / std::numbers::pi;
// The pilot: a sixth of the attitude loop's 15 rad/s (angle gain 8 1/s over a rate crossover of 28 rad/s), and a slow trim of the throttle,
// because a stick is no thrust: a fifth of the vertical loop's frequency.
constexpr double kPilot_rad_s = 2.5, kPilotDamping = 0.9, kTrim_1_s3 = 1.2, kMostTrimWeight = 0.25;
constexpr double kPilotTilt_rad = 0.7, kPilotYaw_1_s = 2.0;
constexpr double kStickCentre_us = 1500.0, kStickHalf_us = 500.0, kStickLow_us = 1000.0, kStickHigh_us = 2000.0;
// Ours 1 front-right, 2 rear-left, 3 front-left, 4 rear-right, in Betaflight's order rear right, front right, rear left, front left.
constexpr std::array<std::size_t, 4> kTheirs{1, 2, 3, 0};
// Where the flight is on Earth matters to nobody; one degree of latitude is 111 320 m.
constexpr double kLongitude_deg = 8.55, kLatitude_deg = 47.4, kMetresPerDegree = 111'320.0;

struct Files {
  host::VehicleModel vehicle;
  host::GainsFile gains;
  BetaflightMap map;
};

Files read_files(const std::filesystem::path& vehicle_file, const std::filesystem::path& gains_file) {
  Files f{host::to_model(host::read_vehicle(vehicle_file, host::builtin_effect_catalogue())), host::read_gains(gains_file), {}};
  const host::Controller c(f.vehicle, host::controller_config(f.gains, host::Variant::pd_ff));
  f.map = {f.gains.omega_min_rad_s, f.gains.omega_max_rad_s, c.hover_omega_rad_s()};
  return f;
}

std::uint16_t stick(double us) { return static_cast<std::uint16_t>(std::lround(std::clamp(us, kStickLow_us, kStickHigh_us))); }

host::ControllerConfig pilot_config(const Files& f) {
  host::ControllerConfig c = host::controller_config(f.gains, host::Variant::pd_ff_drag);
  c.gains.horizontal = c.gains.vertical = {kPilot_rad_s, kPilotDamping};
  c.limits.tilt_max_rad = kPilotTilt_rad;
  c.period_s = 1e-3 * kStepsPerStick;
  return c;
}


// Our position loop as a pilot in angle mode: roll and pitch sticks are angles, throttle is thrust, yaw is a rate.
class Pilot {
 public:
  explicit Pilot(const Files& f)
      : map_(f.map), weight_N_(f.vehicle.weight_N()), mass_kg_(f.vehicle.mass_kg), loop_(f.vehicle, pilot_config(f)) {}

  BetaflightSticks sticks(const rotorloop_controller_input& in) {
    BetaflightSticks s;
    s.fill(static_cast<std::uint16_t>(kStickCentre_us));
    const bool flying = in.phase == ROTORLOOP_PHASE_FLYING;
    s[2] = stick(kStickLow_us);
    s[4] = stick(in.t_s >= kArm_s && in.phase != ROTORLOOP_PHASE_SAFE ? kStickHigh_us : kStickLow_us);  // arm
    s[5] = stick(kStickHigh_us);                                                                        // angle mode
    if (!flying) return s;
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
    if (in.t_s >= kStart_s) {  // on the stand an error of height says nothing
      const double error_m = setpoint.p_W_m.z() - estimate.p_W_m.z(), most = kMostTrimWeight * weight_N_ / mass_kg_;
      trim_m_s2_ = std::clamp(trim_m_s2_ + kTrim_1_s3 * error_m * 1e-3 * kStepsPerStick, -most, most);
    }
    setpoint.a_W_m_s2.z() += trim_m_s2_;
    wanted_ = loop_.step(state_, estimate, setpoint).diagnostics;
    const Eigen::Matrix3d R = wanted_.q_WB_sp.toRotationMatrix();
    const double roll_deg = kDeg_per_rad * std::atan2(R(2, 1), R(2, 2)),
                 pitch_deg = kDeg_per_rad * std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
    const Eigen::Matrix3d B = estimate.q_WB.toRotationMatrix();
    const double off_rad = std::remainder(in.setpoint_yaw_rad - std::atan2(B(1, 0), B(0, 0)), 2.0 * std::numbers::pi);
    const double yaw_deg_s = kDeg_per_rad * (kPilotYaw_1_s * off_rad + in.setpoint_yaw_rate_rad_s);
    s[0] = stick(kStickCentre_us + kStickHalf_us * roll_deg / kAngleLimit_deg);
    s[1] = stick(kStickCentre_us + kStickHalf_us * pitch_deg / kAngleLimit_deg);
    s[2] = stick(throttle_us(wanted_.thrust_B_N));
    s[3] = stick(kStickCentre_us - kStickHalf_us * yaw_deg_s / kFullStickRate_deg_s);
    return s;
  }
  const host::Diagnostics& wanted() const { return wanted_; }

 private:
  // Thrust goes with the square of the speed, output with the speed, and above idle and the end of its dead travel stick with output.
  double throttle_us(double thrust_N) const {
    const double share = (map_.output(map_.hover_omega_rad_s * std::sqrt(thrust_N / weight_N_)) - kMotorIdle) / (1.0 - kMotorIdle);
    return kMinCheck_us + std::clamp(share, 0.0, 1.0) * (kStickHigh_us - kMinCheck_us);
  }

  BetaflightMap map_;
  double weight_N_, mass_kg_, trim_m_s2_ = 0.0;
  host::Controller loop_;
  host::ControllerState state_;
  host::Diagnostics wanted_;
};

BetaflightState state_of(const rotorloop_controller_input& in) {
  const auto& w = in.gyro_B_rad_s;
  const auto& a = in.accel_B_m_s2;
  const auto& q = in.estimate_q_WB;
  const auto& v = in.estimate_v_W_m_s;
  const auto& p = in.estimate_p_W_m;
  BetaflightState s{
      .t_s = in.t_s,
      .rate_rad_s = {w[0], -w[1], w[2]},
      .specific_force_m_s2 = {a[0], -a[1], -a[2]},
      .velocity_m_s = {v[0], v[1], v[2]},
      .longitude_latitude_deg_altitude_m = {kLongitude_deg + p[0] / kMetresPerDegree, kLatitude_deg + p[1] / kMetresPerDegree, p[2]},
      .pressure_Pa = 101'325.0 * std::pow(1.0 - 2.25577e-5 * p[2], 5.25588)};  // standard atmosphere
  if (in.estimate_valid) s.q_wxyz = {q[0], q[1], -q[2], -q[3]};
  return s;
}

// What a flight log of Betaflight would note, on standard error with the time.
class Notes {
 public:
  void add(const rotorloop_controller_input& in, const std::array<float, 4>& motors, const BetaflightMap& map) {
    const bool turning = std::any_of(motors.begin(), motors.end(), [](float m) { return m > 0.0f; });
    if (turning && !armed_) note(in, "armed: motor outputs above zero");
    if (!turning && armed_) note(in, "disarmed: motor outputs at zero");
    armed_ = turning;
    for (std::size_t i = 0; i < 4; ++i) {
      const double wanted = map.omega_rad_s(motors[kTheirs[i]]), speed = in.omega_rad_s[i];
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
std::filesystem::path work_folder(const std::string& log_folder) {
  if (!log_folder.empty()) return log_folder;
  std::string pattern = (std::filesystem::temp_directory_path() / "rotorloop-betaflight-XXXXXX").string();
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

rotorloop_controller_output answer(const Files& f, const Pilot& pilot, const std::array<float, 4>& motors) {
  rotorloop_controller_output out = empty_output();
  for (std::size_t i = 0; i < 4; ++i) out.omega_rad_s[i] = f.map.omega_rad_s(std::clamp(static_cast<double>(motors[kTheirs[i]]), 0.0, 1.0));
  const Eigen::Quaterniond& q = pilot.wanted().q_WB_sp;
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  std::copy(wxyz.begin(), wxyz.end(), out.q_WB);
  out.thrust_N = pilot.wanted().thrust_B_N;
  return out;
}

void fly(const Files& f, BetaflightLink& link) {
  Pilot pilot(f);
  Notes notes;
  std::array<float, 4> motors{};
  int missed = 0;
  std::uint64_t states = 0, unanswered = 0;
  std::string line;
  rotorloop_controller_input in{};
  while (std::getline(std::cin, line)) {
    if (const auto why = parse_input(line, in); !why.empty())
      throw Error({"handshake", why, "", "use the rotorloop that started this bridge"});
    if (states == 0) link.get_in_step();  // only now: each answer has a wait of its own
    if (in.step % kStepsPerStick == 0) link.send(in.t_s, pilot.sticks(in));
    link.send(state_of(in));
    missed = link.receive(motors) ? 0 : missed + 1;
    ++states;
    unanswered += missed > 0;
    if (missed > 0 && !link.running()) throw Error({"betaflight", "its program has ended", "", "see betaflight.log"}, ExitCode::device);
    if (missed > kMostMissed)
      throw Error({"betaflight", fmt::format("no motor packet for {} states", missed), "it hangs", "see betaflight.log"}, ExitCode::device);
    notes.add(in, motors, f.map);
    say(output_line(in.step, answer(f, pilot, motors)));
  }
  fmt::print(stderr, "{} states, {} of them without an answer within {} ms\n", states, unanswered, BetaflightLink::kMotorWait_ms);
}

}  // namespace

std::filesystem::path betaflight_program() {
  const char* path = std::getenv("ROTORLOOP_BETAFLIGHT");
  if (!path || !*path)
    throw Error({"ROTORLOOP_BETAFLIGHT", "is not set", "", "set it to the path of Betaflight's simulator program (docs/controller.md)"},
                ExitCode::device);
  if (!std::filesystem::is_regular_file(path))
    throw Error({"ROTORLOOP_BETAFLIGHT", fmt::format("\"{}\": no such file", path), "", "give the path of Betaflight's simulator program"},
                ExitCode::device);
  return std::filesystem::absolute(path);
}

std::string betaflight_config_of(const std::filesystem::path& vehicle_file, const std::filesystem::path& gains_file) {
  const Files f = read_files(vehicle_file, gains_file);
  return betaflight_config(f.vehicle, f.map);
}

int serve_betaflight() {
  std::string line;
  HandshakeSetup setup;
  if (!std::getline(std::cin, line)) return 1;
  bool greeted = false;
  try {
    if (const auto why = parse_setup(line, setup); !why.empty())
      throw Error({"handshake", why, "", "use the rotorloop that started this bridge"});
    const Files f = read_files(setup.vehicle_file, setup.gains_file);
    BetaflightLink link(betaflight_program(), work_folder(setup.log_folder), betaflight_config(f.vehicle, f.map));
    say(hello_line({.level = ROTORLOOP_LEVEL_ROTOR_SPEED, .every = 1, .own_estimate = false, .start_s = kStart_s}));
    greeted = true;
    fly(f, link);
  } catch (const Error& e) {
    fmt::print(stderr, "{}\n", one_line(e.what()));  // the run shows the last line
    if (!greeted) say(nlohmann::json{{"error", e.what()}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return static_cast<int>(e.exit_code());
  }
  return 0;
}

}  // namespace rotorloop::hil
