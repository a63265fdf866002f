#include "bench/hil/processes/fly_process.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "protocols/state_channel.hpp"

namespace rotorloop::hil {
namespace {

namespace state = protocols::state;

constexpr std::int64_t kPoll_ns = 1'000'000;  // paced: the flight computer watches for what does not come

}  // namespace

std::optional<StampedFrame> SampleBySample::receive() {
  if (sample_given_) return std::nullopt;
  const auto received = bus_.receive();
  sample_given_ = received && !received->frame.extended && received->frame.id == state::kAccelId;  // the second frame of a sample
  return received;
}

FlyProcess::FlyProcess(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request, const ProcessPace& pace,
                       double ceiling_rad_s, TimedBus& state_bus, TimedBus& esc_bus, const std::atomic<bool>* stop)
    : config_(loop_config(scenario, inputs, request)),
      pace_(pace),
      state_bus_(state_bus),
      sample_bus_(state_bus),
      opened_ns_(state_bus.now_ns()),
      heard_ns_(opened_ns_) {
  controller_ = make_controller(scenario, inputs, request, stop, config_);
  config_.computer.escs.esc_node_ids = pace.esc_nodes;
  config_.computer.always_command = true;
  config_.computer.ceiling_rad_s = ceiling_rad_s;
  const host::Trajectory& trajectory = inputs.trajectories[request.flight];
  end_us_ = static_cast<std::int64_t>(1e6 * flight_duration_s(config_, trajectory));
  computer_ = std::make_unique<host::FlightComputer>(inputs.vehicle, config_.computer, *controller_, trajectory, sample_bus_, esc_bus);
}

// The airframe's time. In lockstep it stands still between two samples.
std::int64_t FlyProcess::now_us() const {
  if (record_us_ < 0) return 0;
  if (pace_.pace <= 0.0) return record_us_;
  return static_cast<std::int64_t>(1e-3 * static_cast<double>(state_bus_.now_ns() - begun_ns_) * pace_.pace);
}

void FlyProcess::finish(ExitCode code, std::string reason) {
  if (end_.ended) return;
  end_ = {.ended = true, .code = code, .reason = std::move(reason)};
  computer_->disarm(now_us());
  for (int i = 0; i < 2; ++i) computer_->poll(now_us());  // the first makes ArmingStatus 0 due, the second sends it
}

void FlyProcess::stop(std::string reason) { finish(ExitCode::safety, std::move(reason)); }

std::int64_t FlyProcess::advance() {
  do {
    sample_bus_.go_on();
    computer_->poll(now_us());
    if (const host::FlightRecord* record = computer_->take_record()) judge(*record);
  } while (sample_bus_.sample_given());
  if (!end_.ended && record_us_ < 0) announce();
  if (!end_.ended) look_for_silence();
  return state_bus_.now_ns() + (record_us_ >= 0 && pace_.pace > 0.0 ? kPoll_ns : kLook_ns);
}

// Until the airframe begins: it waits for a controller.
void FlyProcess::announce() {
  const std::int64_t bus_ns = state_bus_.now_ns();
  if (bus_ns - announced_ns_ < kLook_ns) return;
  announced_ns_ = bus_ns;
  for (const CanFrame& f : state::encode(state::ControllerStatus{}, announcements_)) state_bus_.send(f);
  announcements_ = static_cast<std::uint8_t>((announcements_ + 1) % state::kSequenceModulo);
}

void FlyProcess::look_for_silence() {
  const std::int64_t silent_ns = state_bus_.now_ns() - heard_ns_;
  if (record_us_ < 0) {
    if (silent_ns > pace_.wait_ns) finish(ExitCode::device, fmt::format("no airframe on {}: no IMU sample was heard", state_bus_.name()));
    return;
  }
  // Paced, the flight computer has noticed long before.
  if (computer_->phase() == host::FlightPhase::safe && !pending_.ended)
    pending_ = {.ended = true, .code = ExitCode::safety, .reason = host::describe(computer_->safe_state())};
  if (silent_ns <= pace_.silence_ns) return;
  if (pending_.ended) return finish(pending_.code, pending_.reason);
  finish(ExitCode::safety, fmt::format("the airframe is silent at {:.3f} s of the flight, for {:.3g} s: motors disarmed", flown_s(),
                                       1e-9 * static_cast<double>(pace_.silence_ns)));
}

void FlyProcess::judge(const host::FlightRecord& record) {
  if (record_us_ < 0) begun_ns_ = state_bus_.now_ns() - static_cast<std::int64_t>(1e3 * static_cast<double>(record.time_us));
  heard_ns_ = state_bus_.now_ns();
  record_us_ = record.time_us;
  ++samples_;
  if (on_record) on_record(record);
  if (const char* why = controller_->failure()) return finish(ExitCode::incomplete, why);
  if (record.phase == host::FlightPhase::safe && !pending_.ended)
    pending_ = {.ended = true, .code = ExitCode::safety, .reason = host::describe(computer_->safe_state())};
  if (record_us_ >= end_us_ && !pending_.ended) {
    pending_.ended = true;
    computer_->disarm(now_us());
  }
  if (!pending_.ended) return;
  if (run_down_until_us_ < 0) run_down_until_us_ = record_us_ + kRunDown_us;
  if (record_us_ >= run_down_until_us_) finish(pending_.code, pending_.reason);
}

}  // namespace rotorloop::hil
