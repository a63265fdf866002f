#include "bench/hil/processes/airframe_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocols/fast_channel.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::hil {
namespace {

namespace fast = protocols::fast;
namespace state = protocols::state;

constexpr std::int64_t kMs_ns = 1'000'000;

std::string numbers(const std::set<int>& all) { return fmt::format("{}", fmt::join(all, ", ")); }

}  // namespace

AirframeProcess::AirframeProcess(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request, const ProcessPace& pace,
                                 TimedBus& state_bus, TimedBus& esc_bus)
    : config_(loop_config(scenario, inputs, request)),
      pace_(pace),
      state_bus_(state_bus),
      esc_bus_(esc_bus),
      plant_(make_flying_plant(inputs.plant, sim::pointers(inputs.rotors), inputs.trajectories[request.flight], config_, state_bus)),
      end_ns_(static_cast<std::int64_t>(1e9 * flight_duration_s(config_, inputs.trajectories[request.flight]))),
      opened_ns_(state_bus.now_ns()),
      heard_ns_(opened_ns_) {
  receiver_.anchor(0, 0);
}

void AirframeProcess::finish(ExitCode code, std::string reason) {
  if (!end_.ended) end_ = {.ended = true, .code = code, .reason = std::move(reason)};
}

// The first reason counts; the flight goes on until the motors had time to stop.
void AirframeProcess::run_down(ExitCode code, std::string reason) {
  if (pending_.ended) return;
  pending_ = {.ended = true, .code = code, .reason = std::move(reason)};
  run_down_until_ns_ = now_ns_ + kRunDown_us * 1000;
}

std::int64_t AirframeProcess::advance() {
  hear_escs();
  hear_controller();
  if (!begun_) look_for_others();
  while (begun_ && !end_.ended && due()) step_ms();
  if (begun_ && !end_.ended) look_for_silence();
  const std::int64_t look_ns = state_bus_.now_ns() + kLook_ns;
  return begun_ && deadlines_ ? std::min(look_ns, deadlines_->next_ns()) : look_ns;
}

void AirframeProcess::hear_escs() {
  while (const auto received = esc_bus_.receive()) {
    const CanFrame& f = received->frame;
    if (f.extended) {
      const protocols::FrameId id = protocols::decode_id(f.id);
      if (id.kind == protocols::TransferKind::message && id.data_type_id == protocols::NodeStatus::kType.id) nodes_.insert(id.source);
      continue;
    }
    const auto feedback = fast::decode_feedback(f);
    if (!feedback || feedback->esc_index >= answered_.size()) continue;
    ++feedback_heard_;
    heard_ns_ = esc_bus_.now_ns();
    answered_[feedback->esc_index] = true;
    // An ESC that does not know its rotor's speed drives none.
    const double speed_rad_s = feedback->speed_valid() ? std::fabs(static_cast<double>(feedback->speed_rad_s())) : 0.0;
    reported_rad_s_[feedback->esc_index] = speed_rad_s;
    fastest_rad_s_ = std::max(fastest_rad_s_, speed_rad_s);
  }
}

void AirframeProcess::hear_controller() {
  while (const auto received = state_bus_.receive()) {
    const state::StateEvent event = receiver_.on_frame(received->frame, now_ns_ / 1000);
    if (event.setpoint) judge(*event.setpoint);
    if (!event.status) continue;
    controller_heard_ = true;
    heard_ns_ = state_bus_.now_ns();
    tracking_ = event.status->mode == state::ControllerMode::tracking;
    if (event.status->mode == state::ControllerMode::failsafe)
      run_down(ExitCode::safety, fmt::format("the controller went to its safe state at {:.3f} s", flown_s()));
    else if (was_armed_ && !event.status->armed && now_ns_ < end_ns_)
      run_down(ExitCode::safety, fmt::format("the controller disarmed at {:.3f} s, before the end of the flight", flown_s()));
    was_armed_ = event.status->armed;
  }
}

void AirframeProcess::judge(const state::TrackingSetpoint& s) {
  ++setpoints_heard_;
  const std::int64_t age_ns = now_ns_ - s.time_us * 1000;
  if (!begun_ || !tracking_ || age_ns < 0 || age_ns >= static_cast<std::int64_t>(kTruths) * kMs_ns) return;
  const Eigen::Vector3d& p_W_m = truth_p_W_m_[static_cast<std::size_t>(s.time_us / 1000) % kTruths];
  meter_.add(
      {1e-6 * static_cast<double>(s.time_us), p_W_m, p_W_m, Eigen::Vector3d(s.p_W_m.data()), Eigen::Vector3d(s.v_W_m_s.data()), s.yaw_rad});
}

void AirframeProcess::look_for_others() {
  std::set<int> missing;
  for (const std::uint8_t id : pace_.esc_nodes)
    if (!nodes_.contains(id)) missing.insert(id);
  if (missing.empty() && controller_heard_) {
    begun_ = true;
    heard_ns_ = state_bus_.now_ns();
    if (pace_.pace > 0.0) deadlines_.emplace(heard_ns_ + std::llround(1e6 / pace_.pace), std::llround(1e6 / pace_.pace), pace_.catch_up_ns);
    answered_.fill(false);
    sample();
    return;
  }
  if (state_bus_.now_ns() - opened_ns_ < pace_.wait_ns) return;
  const std::string heard = nodes_.empty() ? "nobody" : "nodes " + numbers(nodes_);
  finish(ExitCode::device, missing.empty()
                               ? fmt::format("no controller on {}: no status was heard", state_bus_.name())
                               : fmt::format("ESC nodes {} are missing on {}; {} answered", numbers(missing), esc_bus_.name(), heard));
}

// In lockstep the next millisecond is due when all four have answered; paced, when its time has come.
bool AirframeProcess::due() {
  if (!deadlines_) return std::all_of(answered_.begin(), answered_.end(), [](bool a) { return a; });
  if (state_bus_.now_ns() < deadlines_->next_ns()) return false;
  if (deadlines_->begin_step(state_bus_.now_ns())) return true;
  finish(ExitCode::safety, fmt::format("too far behind real time at {:.3f} s: {:.1f} ms behind", flown_s(),
                                       1e-6 * static_cast<double>(deadlines_->lateness().worst_ns)));
  return false;
}

// A second of quiet is no fault of a machine that does something else; the limit is the user's.
void AirframeProcess::look_for_silence() {
  if (state_bus_.now_ns() - heard_ns_ <= pace_.silence_ns) return;
  std::set<int> silent;
  for (std::size_t i = 0; i < answered_.size(); ++i)
    if (!answered_[i]) silent.insert(static_cast<int>(i) + 1);
  const std::string who =
      silent.empty() || silent.size() == answered_.size() ? "the controller and its ESCs are" : fmt::format("ESC {} is", numbers(silent));
  const double limit_s = 1e-9 * static_cast<double>(pace_.silence_ns);
  if (pending_.ended) return finish(pending_.code, pending_.reason);
  finish(ExitCode::safety, fmt::format("{} silent at {:.3f} s of the flight, for {:.3g} s", who, flown_s(), limit_s));
}

// One ms: the rotors' speeds go from the last report to this one while the airframe moves.
void AirframeProcess::step_ms() {
  answered_.fill(false);
  const int steps = config_.airframe_Hz / 1000;
  std::array<double, 4> omega_dot{};
  for (std::size_t i = 0; i < 4; ++i) omega_dot[i] = (reported_rad_s_[i] - omega_rad_s_[i]) * 1000.0;
  for (int k = 0; k < steps; ++k) {
    plant_.dynamics->step(omega_dot);
    now_ns_ += kMs_ns / steps;
    for (std::size_t i = 0; i < 4; ++i) omega_rad_s_[i] = std::max(0.0, omega_rad_s_[i] + omega_dot[i] / config_.airframe_Hz);
    sample();
  }
  if (airframe().ended())
    run_down(ExitCode::verdict, airframe().status() == sim::AirframeStatus::below_ground
                                    ? fmt::format("below ground at {:.3f} s", flown_s())
                                    : fmt::format("diverged at {:.3f} s", flown_s()));
  if (now_ns_ >= end_ns_) run_down(ExitCode::ok, "");
  if (pending_.ended && now_ns_ >= run_down_until_ns_) finish(pending_.code, pending_.reason);
}

void AirframeProcess::sample() {
  plant_.dynamics->evaluate_rotors(omega_rad_s_);
  if (now_ns_ % kMs_ns == 0) truth_p_W_m_[static_cast<std::size_t>(now_ns_ / kMs_ns) % kTruths] = airframe().state().p_W_m;
  if (plant_.sensors->poll(now_ns_, airframe().state(), omega_rad_s_) && on_truth) on_truth(flown_s(), truth());
}

PlantTruth AirframeProcess::truth() const {
  PlantTruth t;
  t.state = airframe().state();
  t.omega_rad_s = omega_rad_s_;
  const auto& loads = plant_.dynamics->loads();
  for (std::size_t i = 0; i < t.thrust_N.size(); ++i) {
    t.thrust_N[i] = loads[i].force_R_N.z();
    t.shaft_torque_N_m[i] = loads[i].shaft_torque_N_m;
  }
  return t;
}

}  // namespace rotorloop::hil
