#include "bench/hil/live/setpoint_clock.hpp"

#include "protocols/fast_channel.hpp"

namespace rotorloop::live {

namespace fast = protocols::fast;

SetpointClock::SetpointClock(TimedBus& bus, std::uint8_t group, std::int64_t silence_ns)
    : bus_(bus), group_(group), silence_ns_(silence_ns), now_ns_(bus.now_ns()), heard_ns_(now_ns_), looked_ns_(now_ns_) {}

bool SetpointClock::begin_step() {
  while (auto received = bus_.receive_any()) {
    const auto frame = received->frame.classic();
    received->time_ns = now_ns_;
    arrived_.push_back(*received);
    const auto setpoint = frame ? fast::decode_setpoint(*frame) : std::nullopt;
    if (!setpoint || setpoint->group != group_) continue;
    stepped_ = true;
    ++steps_;
    heard_ns_ = bus_.now_ns();
    now_ns_ += kStep_ns;
    return true;
  }
  const std::int64_t bus_ns = bus_.now_ns();
  if (stepped_ && bus_ns - heard_ns_ > silence_ns_) {
    stepped_ = false;
    looked_ns_ = bus_ns;
  }
  if (stepped_ || bus_ns == looked_ns_) return false;
  now_ns_ += bus_ns - looked_ns_;
  looked_ns_ = bus_ns;
  return true;
}

void SetpointClock::end_step() {
  if (answer_) bus_.send_any(*answer_);
  answer_.reset();
}

SendStatus SetpointClock::send_any(const BusFrame& frame) {
  const auto classic = frame.classic();
  if (!stepped_ || !classic || !fast::is_feedback_id(*classic)) return bus_.send_any(frame);
  answer_ = frame;
  return SendStatus::queued;
}

std::optional<StampedBusFrame> SetpointClock::receive_any() {
  if (arrived_.empty()) return std::nullopt;
  const StampedBusFrame frame = arrived_.front();
  arrived_.pop_front();
  return frame;
}

}  // namespace rotorloop::live
