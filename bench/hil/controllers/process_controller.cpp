#include "bench/hil/controllers/process_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

namespace rotorloop::hil {
namespace {

constexpr double kUnit = 0.1;           // a quaternion may be this far from length 1: rounding of a text, not a mistake
constexpr double kFarthest_m = 1e4;     // of a position set-point: no flight of this bench goes there
constexpr double kFastest_rad_s = 100;  // of a body rate set-point: beyond any gyro's range

std::filesystem::path error_log(const std::string& folder) {
  return folder.empty() ? std::filesystem::path() : std::filesystem::path(folder) / "controller.log";
}

Eigen::Quaterniond quaternion(const double (&a)[4]) { return {a[0], a[1], a[2], a[3]}; }

template <std::size_t N>
bool within(const double (&a)[N], double most) {
  return std::all_of(a, a + N, [&](double v) { return std::fabs(v) <= most; });  // false for not-a-number
}
bool is_rotation(const double (&q)[4]) {
  return std::fabs(std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) - 1.0) <= kUnit;
}

void put(const Eigen::Vector3d& v, double (&out)[3]) { std::copy_n(v.data(), 3, out); }
void put(const Eigen::Quaterniond& q, double (&out)[4]) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

template <std::size_t N>
void clear(double (&out)[N]) {
  std::fill_n(out, N, std::numeric_limits<double>::quiet_NaN());
}

rotorloop_controller_input plain(const host::ControlInput& c, std::uint64_t step) {
  rotorloop_controller_input in{};
  in.size = sizeof in;
  in.phase = static_cast<std::uint32_t>(c.phase);
  in.step = step;
  in.t_s = static_cast<double>(c.time_us) * 1e-6;
  put(c.imu.gyro_B_rad_s, in.gyro_B_rad_s);
  put(c.imu.accel_B_m_s2, in.accel_B_m_s2);
  in.pose_new = c.pose != nullptr;
  if (c.pose) {
    in.pose_t_s = static_cast<double>(c.pose->time_us) * 1e-6;
    put(c.pose->p_W_m, in.pose_p_W_m);
    put(c.pose->q_WS, in.pose_q_WS);
    put(c.pose->v_W_m_s, in.pose_v_W_m_s);
  } else {
    in.pose_t_s = std::numeric_limits<double>::quiet_NaN();
    clear(in.pose_p_W_m);
    clear(in.pose_q_WS);
    clear(in.pose_v_W_m_s);
  }
  in.estimate_valid = c.estimate.valid;
  put(c.estimate.p_W_m, in.estimate_p_W_m);
  put(c.estimate.v_W_m_s, in.estimate_v_W_m_s);
  put(c.estimate.q_WB, in.estimate_q_WB);
  put(c.estimate.w_B_rad_s, in.estimate_w_B_rad_s);
  put(c.setpoint.p_W_m, in.setpoint_p_W_m);
  put(c.setpoint.v_W_m_s, in.setpoint_v_W_m_s);
  put(c.setpoint.a_W_m_s2, in.setpoint_a_W_m_s2);
  put(c.setpoint.j_W_m_s3, in.setpoint_j_W_m_s3);
  in.setpoint_yaw_rad = c.setpoint.yaw_rad;
  in.setpoint_yaw_rate_rad_s = c.setpoint.yaw_rate_rad_s;
  std::copy(c.omega_rad_s.begin(), c.omega_rad_s.end(), in.omega_rad_s);
  in.bus_V = c.bus_V;
  return in;
}

host::Setpoint setpoint_of(const rotorloop_controller_output& o) {
  return {.p_W_m = vector(o.p_W_m),
          .v_W_m_s = vector(o.v_W_m_s),
          .a_W_m_s2 = vector(o.a_W_m_s2),
          .j_W_m_s3 = vector(o.j_W_m_s3),
          .yaw_rad = o.yaw_rad,
          .yaw_rate_rad_s = o.yaw_rate_rad_s};
}

host::StateEstimate estimate_of(const rotorloop_controller_output& o, std::int64_t time_us) {
  return {.time_us = time_us,
          .p_W_m = vector(o.estimate_p_W_m),
          .v_W_m_s = vector(o.estimate_v_W_m_s),
          .q_WB = quaternion(o.estimate_q_WB),
          .w_B_rad_s = vector(o.estimate_w_B_rad_s),
          .valid = true};
}

host::Limiters limiters_of(std::uint32_t bits) {
  return {.tilt = (bits & 1u) != 0,
          .thrust = (bits & 2u) != 0,
          .roll_pitch = (bits & 4u) != 0,
          .yaw = (bits & 8u) != 0,
          .table_edge = (bits & 16u) != 0,
          .direction_held = (bits & 32u) != 0};
}

// Last line that the program wrote to its standard error: most say there why they end.
std::string last_line_of(const std::filesystem::path& log) {
  std::ifstream in(log);
  std::string line, last;
  while (std::getline(in, line))
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  return last.empty() ? "" : " (its last line on standard error: " + last.substr(0, 200) + ")";
}

}  // namespace

ProcessController::ProcessController(const host::VehicleModel& vehicle, const ProcessControllerConfig& config)
    : config_(config),
      below_(vehicle, config.below),
      most_thrust_N_(config.below.limits.total_max_weight * vehicle.weight_N()),
      child_(config.command, error_log(config.setup.log_folder)) {
  config_.setup.period_s = config.below.period_s;
  config_.setup.mass_kg = vehicle.mass_kg;
  config_.setup.hover_omega_rad_s = below_.hover_omega_rad_s();
  config_.setup.omega_min_rad_s = config.below.omega_min_rad_s;
  config_.setup.omega_max_rad_s = config.below.omega_max_rad_s;
  child_.send(setup_line(config_.setup));  // a program that has ended already is noticed by the wait
  std::string line;
  if (!receive(line, "to the first line")) return;
  if (const auto why = parse_hello(line, hello_); !why.empty()) fail(why);
}

void ProcessController::fail(const std::string& what) {
  if (failure_.empty()) failure_ = fmt::format("controller {}: {}", config_.name, what);
}

bool ProcessController::receive(std::string& line, const std::string& when) {
  switch (child_.receive(line, config_.timeout_s, config_.stop)) {
    case LineProcess::Wait::line:
      return true;
    case LineProcess::Wait::timeout:
      fail(fmt::format("no answer for {} s {}", config_.timeout_s, when));
      break;
    case LineProcess::Wait::ended:
      fail(fmt::format("{} {}{}", child_.ending(), when, last_line_of(error_log(config_.setup.log_folder))));
      break;
    case LineProcess::Wait::stopped:
      fail("interrupted");
      break;
  }
  return false;
}

void ProcessController::ask(const rotorloop_controller_input& in) {
  const std::string when = fmt::format("at step {} ({:.3f} s)", in.step, in.t_s);
  child_.send(input_line(in));
  std::string line;
  if (!receive(line, when)) return;
  if (const auto why = parse_output(line, in.step, answer_); !why.empty()) fail(fmt::format("{} {}", why, when));
}

bool ProcessController::usable(const rotorloop_controller_output& o) const {
  const double optional_most = std::max(kFarthest_m, kFastest_rad_s);
  if (hello_.own_estimate && !(within(o.estimate_p_W_m, kFarthest_m) && within(o.estimate_v_W_m_s, kFarthest_m) &&
                               is_rotation(o.estimate_q_WB) && within(o.estimate_w_B_rad_s, kFastest_rad_s)))
    return false;
  switch (hello_.level) {
    case ROTORLOOP_LEVEL_POSITION:
      return within(o.p_W_m, kFarthest_m) && within(o.v_W_m_s, optional_most) && within(o.a_W_m_s2, optional_most) &&
             within(o.j_W_m_s3, optional_most) && std::fabs(o.yaw_rad) <= optional_most && std::fabs(o.yaw_rate_rad_s) <= kFastest_rad_s;
    case ROTORLOOP_LEVEL_ATTITUDE:
      return is_rotation(o.q_WB) && within(o.w_B_rad_s, kFastest_rad_s) && o.thrust_N >= 0.0 && o.thrust_N <= most_thrust_N_;
    default:
      return std::all_of(o.omega_rad_s, o.omega_rad_s + host::kRotors,
                         [&](double w) { return w >= below_.config().omega_min_rad_s && w <= below_.config().omega_max_rad_s; });
  }
}

host::Command ProcessController::speeds_of_answer(const host::ControlInput& input) {
  host::Command out;
  ++state_.counters.steps;
  std::copy_n(good_.omega_rad_s, host::kRotors, out.omega_rad_s.begin());
  host::Diagnostics& d = out.diagnostics;
  d.limiters = limiters_of(good_.limiters);
  state_.counters.limited += d.limiters != host::Limiters{};
  d.estimate_invalid = !input.estimate.valid;
  d.q_WB_sp = quaternion(good_.q_WB);
  d.thrust_B_N = good_.thrust_N;
  d.torque_B_N_m = vector(good_.torque_B_N_m);
  return out;
}

host::Command ProcessController::command_of_answer(const host::ControlInput& input) {
  const host::StateEstimate estimate = hello_.own_estimate ? estimate_of(good_, input.time_us) : input.estimate;
  host::Command out;
  if (hello_.level == ROTORLOOP_LEVEL_POSITION)
    out = below_.step(state_, estimate, setpoint_of(good_));
  else if (hello_.level == ROTORLOOP_LEVEL_ATTITUDE)
    out = below_.follow(state_, estimate, {quaternion(good_.q_WB), vector(good_.w_B_rad_s), good_.thrust_N});
  else
    out = speeds_of_answer(input);
  if (hello_.own_estimate) out.estimate = estimate;
  return out;
}

host::Command ProcessController::step(const host::ControlInput& input) {
  const bool asked = failure_.empty() && steps_ % hello_.every == 0;
  if (asked) ask(plain(input, steps_));
  ++steps_;
  const bool answered = asked && failure_.empty();
  const bool good = answered && usable(answer_);
  if (good) good_ = answer_;
  any_good_ = any_good_ || good;
  host::Command out;
  if (any_good_)
    out = command_of_answer(input);
  else
    out.omega_rad_s.fill(std::clamp(below_.hover_omega_rad_s(), below_.config().omega_min_rad_s, below_.config().omega_max_rad_s));
  // Before it has the rotors, nothing that it says is a command.
  if (!answered) out.answer = host::Answer::held;
  if (answered && !good && input.phase == host::ControlPhase::flying) {
    out.answer = host::Answer::refused;
    ++state_.counters.bad_input;
  }
  return out;
}

}  // namespace rotorloop::hil
