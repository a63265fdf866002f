#include "host/bus/timed_bus.hpp"

namespace rotorloop {

std::optional<StampedBusFrame> TimedBus::receive_until(std::int64_t deadline_ns) {
  while (true) {
    if (auto frame = receive_any()) return frame;
    if (now_ns() >= deadline_ns) return std::nullopt;
    wait_until(deadline_ns);
  }
}

std::optional<StampedFrame> TimedBus::receive() {
  while (const auto received = receive_any()) {
    if (const auto frame = received->frame.classic()) return StampedFrame{.frame = *frame, .time_ns = received->time_ns};
    ++fd_passed_over_;
  }
  return std::nullopt;
}

}  // namespace rotorloop
