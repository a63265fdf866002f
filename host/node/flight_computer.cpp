#include "host/node/flight_computer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rotorloop::host {
namespace {

namespace state = protocols::state;

constexpr std::uint64_t kStepsPerReport = 10;  // set-point and status at 100 Hz
constexpr std::int64_t kSettled_us = 100'000;  // idle speed held this long counts as ready
// One unusable answer of a controller may be a glitch; after this many the rotors have followed an old command for too long: 3 ms, in
// which an uncontrolled attitude at 20 rad/s² turns by less than a tenth of a degree.
constexpr int kMostRefused = 3;
constexpr double kIdleTolerance = 0.10;
constexpr double kIdleSmoothing = 0.05;  // per control step: over 20 ms, so that noise of single reports does not keep the vehicle down

Eigen::Vector3d vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
std::array<double, 3> array(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

FlightComputer::FlightComputer(const VehicleModel& vehicle, const FlightComputerConfig& config, FlightController& controller,
                               const Trajectory& trajectory, CanBus& state_port, CanBus& esc_port)
    : config_(config),
      trajectory_(trajectory),
      state_port_(state_port),
      esc_port_(esc_port),
      estimator_(config.estimator, vehicle),
      controller_(controller),
      escs_(config.escs, esc_port) {
  // The bench starts airframe and computer together: both clocks begin at 0.
  receiver_.anchor(0, 0);
}

const FlightRecord* FlightComputer::take_record() {
  if (!record_ready_) return nullptr;
  record_ready_ = false;
  return &record_;
}

void FlightComputer::poll(std::int64_t now_us) {
  escs_.poll(now_us);
  hear_state_bus(now_us);
  if (phase_ != FlightPhase::safe) watch(now_us);
  escs_.arm(phase_ == FlightPhase::spin_up || phase_ == FlightPhase::flying);
}

void FlightComputer::hear_state_bus(std::int64_t now_us) {
  while (const auto received = state_port_.receive()) {
    const state::StateEvent event = receiver_.on_frame(received->frame, now_us);
    if (event.pose && event.pose->tracking) {
      PoseSample& pose = newest_pose_;
      pose.time_us = event.pose->time_us;
      pose.p_W_m = vector(event.pose->p_W_m);
      pose.q_WS = Eigen::Quaterniond(event.pose->q_WS[0], event.pose->q_WS[1], event.pose->q_WS[2], event.pose->q_WS[3]);
      pose.v_W_m_s = vector(event.pose->v_W_m_s);
      pose_arrived_ = true;
      estimator_.on_pose(pose);
    }
    if (event.imu) {
      last_imu_us_ = now_us;
      control_step({event.imu->time_us, vector(event.imu->gyro_B_rad_s), vector(event.imu->accel_B_m_s2)}, now_us);
    }
  }
}

void FlightComputer::control_step(const ImuSample& imu, std::int64_t now_us) {
  record_.time_us = imu.time_us;
  record_.pose = newest_pose_;
  record_.pose_new = pose_arrived_;
  pose_arrived_ = false;
  record_.imu = imu;
  record_.estimate = estimator_.on_imu(imu);
  const std::int64_t flown_us = imu.time_us - config_.start_us;
  record_.setpoint = trajectory_.at(static_cast<double>(flown_us) * 1e-6);
  advance_phase(flown_us, now_us);
  ask_controller(now_us);

  wanted_rad_s_.fill(0.0);
  if (phase_ == FlightPhase::spin_up) wanted_rad_s_.fill(config_.idle_rad_s);
  if (phase_ == FlightPhase::flying) wanted_rad_s_ = record_.command.omega_rad_s;

  const std::uint64_t divider = 1000u / config_.setpoint_Hz;
  for (double& omega_rad_s : wanted_rad_s_) omega_rad_s = std::min(omega_rad_s, config_.ceiling_rad_s);
  const bool commands = config_.always_command || phase_ == FlightPhase::spin_up || phase_ == FlightPhase::flying;
  if (commands && steps_ % divider == 0) escs_.command(wanted_rad_s_, now_us);
  record_.phase = phase_;
  record_.commanded_rad_s = wanted_rad_s_;
  record_.bus_A = 0.0;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const EscState& e = escs_.esc(i);
    record_.omega_rad_s[i] = e.speed_rad_s;
    record_.current_A[i] = e.current_A;
    record_.bus_A += e.bus_A;
    record_.bus_V = e.bus_V;
  }
  if (steps_ % kStepsPerReport == 0) report(imu.time_us, now_us);
  ++steps_;
  record_ready_ = true;
}

void FlightComputer::ask_controller(std::int64_t now_us) {
  ControlInput input{.time_us = record_.time_us,
                     .phase = phase_,
                     .imu = record_.imu,
                     .pose = record_.pose_new ? &newest_pose_ : nullptr,
                     .estimate = record_.estimate,
                     .setpoint = record_.setpoint,
                     .bus_V = escs_.esc(kRotors - 1).bus_V};
  for (std::size_t i = 0; i < kRotors; ++i) input.omega_rad_s[i] = escs_.esc(i).speed_rad_s;
  record_.command = controller_.step(input);
  if (record_.command.estimate) record_.estimate = *record_.command.estimate;
  if (record_.command.answer == Answer::usable) refused_in_a_row_ = 0;
  if (record_.command.answer == Answer::refused) ++refused_in_a_row_;
  if (refused_in_a_row_ >= kMostRefused && phase_ != FlightPhase::safe) go_safe(SafeReason::controller, -1, now_us);
}

void FlightComputer::advance_phase(std::int64_t flown_us, std::int64_t now_us) {
  if (phase_ == FlightPhase::boot && record_.estimate.valid && escs_.all_operational()) phase_ = FlightPhase::spin_up;
  if (phase_ == FlightPhase::spin_up) {
    for (std::size_t i = 0; i < kRotors; ++i) {
      const double speed_rad_s = escs_.esc(i).speed_rad_s;  // NaN: not known
      if (std::isfinite(speed_rad_s)) {
        idle_speed_rad_s_[i] += kIdleSmoothing * (speed_rad_s - idle_speed_rad_s_[i]);
        speed_known_us_[i] = now_us;
      } else if (now_us - speed_known_us_[i] > config_.esc_timeout_us) {
        idle_speed_rad_s_[i] =
            0.0;  // a report without speed now and then is noise at idle, a time-out of them is a motor that does not turn
      }
    }
    const bool idling = all_at(config_.idle_rad_s, kIdleTolerance);
    if (!idling) ready_since_us_ = -1;
    if (idling && ready_since_us_ < 0) ready_since_us_ = now_us;
    const bool ready = ready_since_us_ >= 0 && now_us - ready_since_us_ >= kSettled_us;
    if (flown_us >= -config_.take_over_us) {
      if (ready) {
        phase_ = FlightPhase::flying;
      } else {
        go_safe(SafeReason::not_ready, slowest_esc(), now_us);
      }
    }
  } else if (phase_ == FlightPhase::boot && flown_us >= -config_.take_over_us) {
    go_safe(SafeReason::not_ready, escs_.first_missing(), now_us);
  }
}

bool FlightComputer::all_at(double omega_rad_s, double tolerance) const {
  for (std::size_t i = 0; i < kRotors; ++i)
    if (!(std::fabs(idle_speed_rad_s_[i] - omega_rad_s) < tolerance * omega_rad_s)) return false;
  return true;
}

int FlightComputer::slowest_esc() const {
  int slowest = 0;
  double worst = -1.0;
  for (std::size_t i = 0; i < kRotors; ++i) {
    const double speed = escs_.esc(i).speed_rad_s;
    const double off = std::isfinite(speed) ? std::fabs(speed - config_.idle_rad_s) : std::numeric_limits<double>::max();
    if (off > worst) {
      worst = off;
      slowest = static_cast<int>(i);
    }
  }
  return slowest;
}

// When the first ESC has timed out: has none of them been heard lately? Then the bus is the part to look at.
bool FlightComputer::all_escs_silent(std::int64_t now_us) const {
  for (std::size_t i = 0; i < kRotors; ++i)
    if (now_us - escs_.esc(i).heard_us <= config_.esc_timeout_us / 2) return false;
  return true;
}

// What the flight depends on, looked at with every poll: the silence of a bus has no frame that could report it.
void FlightComputer::watch(std::int64_t now_us) {
  if (state_port_.state() == BusState::bus_off || esc_port_.state() == BusState::bus_off) return go_safe(SafeReason::bus_off, -1, now_us);
  if (receiver_.refused_for_version() > 0) {
    go_safe(SafeReason::state_version, -1, now_us);
    safe_.fault_code = receiver_.foreign_version();
    return;
  }
  // A computer that never hears its sensors must not wait for ever either.
  const bool imu_lost = last_imu_us_ < 0 ? now_us >= config_.start_us : now_us - last_imu_us_ > config_.imu_timeout_us;
  if (imu_lost) return go_safe(SafeReason::imu_lost, -1, now_us);
  if (phase_ == FlightPhase::boot) return;
  if (!record_.estimate.valid) return go_safe(SafeReason::pose_lost, -1, now_us);
  for (std::size_t i = 0; i < kRotors; ++i) {
    const EscState& e = escs_.esc(i);
    const int number = static_cast<int>(i);
    if (e.fault) {
      go_safe(SafeReason::esc_fault, number, now_us);
      safe_.fault_code = e.fault_code;
      return;
    }
    if (phase_ != FlightPhase::flying) continue;
    if (now_us - e.heard_us > config_.esc_timeout_us)
      return all_escs_silent(now_us) ? go_safe(SafeReason::esc_bus_silent, -1, now_us) : go_safe(SafeReason::esc_silent, number, now_us);
    const bool follows = std::fabs(e.speed_rad_s - wanted_rad_s_[i]) <= 0.5 * wanted_rad_s_[i];
    if (follows || off_since_us_[i] == 0) off_since_us_[i] = now_us;
    if (now_us - off_since_us_[i] <= config_.not_following_us) continue;
    // The ESC may still be trying to end its fault; what it says of it is the reason.
    go_safe(e.fault_code != 0 ? SafeReason::esc_fault : SafeReason::esc_not_following, number, now_us);
    safe_.fault_code = e.fault_code;
    return;
  }
}

void FlightComputer::go_safe(SafeReason reason, int esc, std::int64_t now_us) {
  phase_ = FlightPhase::safe;
  safe_ = {.reason = reason, .esc = esc, .time_us = now_us};
  wanted_rad_s_.fill(0.0);
  record_.phase = phase_;
}

void FlightComputer::report(std::int64_t imu_time_us, std::int64_t now_us) {
  for (const CanFrame& f : state::encode(state::TrackingSetpoint{.time_us = imu_time_us,
                           .p_W_m = array(record_.setpoint.p_W_m),
                           .v_W_m_s = array(record_.setpoint.v_W_m_s),
                           .yaw_rad = record_.setpoint.yaw_rad},
                                         report_sequence_))
    state_port_.send(f);
  const Limiters& l = record_.command.diagnostics.limiters;
  state::ControllerStatus s;
  s.time_us = imu_time_us;
  s.mode = phase_ == FlightPhase::flying                                     ? state::ControllerMode::tracking
           : phase_ == FlightPhase::spin_up                                  ? state::ControllerMode::idle
           : phase_ == FlightPhase::boot || safe_.reason == SafeReason::none ? state::ControllerMode::off
                                                                             : state::ControllerMode::failsafe;
  s.armed = phase_ == FlightPhase::spin_up || phase_ == FlightPhase::flying;
  s.estimate_valid = record_.estimate.valid;
  s.pose_fresh = imu_time_us - newest_pose_.time_us < 100'000;
  s.imu_fresh = now_us - last_imu_us_ <= config_.imu_timeout_us;
  s.limiters = static_cast<std::uint16_t>((l.thrust ? state::kLimitThrust : 0) | (l.tilt ? state::kLimitTilt : 0) |
                                          (l.yaw ? state::kLimitYaw : 0) | (l.roll_pitch ? state::kLimitMotorMax : 0));
  s.motor_limited_count = static_cast<std::uint16_t>(controller_.counters().limited);
  for (const CanFrame& f : state::encode(s, report_sequence_)) state_port_.send(f);
  ++report_sequence_;
}

namespace {
// Fault codes of the ESC's vendor status, docs/wire.md.
const char* fault_text(std::uint8_t code) {
  constexpr std::array<const char*, 8> kTexts{"reports an error",       "reports over-current",    "reports undervoltage",
                                              "reports over-voltage",   "reports a stalled rotor", "reports that the motor did not start",
                                              "reports a sensor fault", "reports over-temperature"};
  return code < kTexts.size() ? kTexts[code] : "reports an unknown fault";
}
}  // namespace

std::string describe(const SafeState& safe) {
  std::string what;
  switch (safe.reason) {
    case SafeReason::none:
      return "no safe state";
    case SafeReason::not_ready:
      what = "not ready to fly in time";
      break;
    case SafeReason::imu_lost:
      what = "IMU samples stopped";
      break;
    case SafeReason::pose_lost:
      what = "estimate not valid: pose messages stopped";
      break;
    case SafeReason::esc_silent:
      what = "silent: no feedback on the ESC bus";
      break;
    case SafeReason::esc_bus_silent:
      what = "ESC bus silent: no feedback of any ESC";
      break;
    case SafeReason::esc_fault:
      what = fault_text(safe.fault_code);
      break;
    case SafeReason::esc_not_following:
      what = "does not follow its set-point";
      break;
    case SafeReason::bus_off:
      what = "bus off";
      break;
    case SafeReason::controller:
      what = "controller: no usable command three times in a row";
      break;
    case SafeReason::late:
      what = "too far behind real time";
      break;
    case SafeReason::state_version:
      what = "state channel: the airframe has version " + std::to_string(safe.fault_code) + ", this computer version " +
             std::to_string(protocols::state::kVersion);
      break;
  }
  const auto ms = safe.time_us / 1000;
  std::string text = safe.esc >= 0 ? "ESC " + std::to_string(safe.esc + 1) + " " : std::string();
  text += what;
  return text + " at " + std::to_string(ms / 1000) + "." + std::to_string(1000 + ms % 1000).substr(1) + " s: motors disarmed";
}

}  // namespace rotorloop::host
