#include "host/bus/live/live_clock.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

namespace rotorloop {

std::int64_t live_now_ns() {
  using std::chrono::duration_cast, std::chrono::nanoseconds;
  static const auto begun = std::chrono::steady_clock::now();
  static const std::int64_t begun_ns = duration_cast<nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  return begun_ns + duration_cast<nanoseconds>(std::chrono::steady_clock::now() - begun).count();
}

std::int64_t live_time_ns(const timespec& stamp) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  const std::int64_t age_ns = (now.tv_sec - stamp.tv_sec) * 1'000'000'000 + (now.tv_nsec - stamp.tv_nsec);
  const bool clock_was_set = age_ns <= 0 || age_ns >= 1'000'000'000;
  return live_now_ns() - (clock_was_set ? 0 : age_ns);
}

void wait_for_any(std::span<TimedBus* const> buses, std::int64_t deadline_ns, int descriptor) {
  std::vector<pollfd> polled;
  for (TimedBus* bus : buses) {
    bus->flush();
    if (bus->input_waits()) return;
    deadline_ns = std::min(deadline_ns, bus->next_flush_ns());
    polled.push_back(
        {.fd = bus->descriptor(), .events = static_cast<short>(bus->output_waits() ? POLLIN | POLLOUT : POLLIN), .revents = 0});
  }
  if (descriptor >= 0) polled.push_back({.fd = descriptor, .events = POLLIN, .revents = 0});
  const std::int64_t left_ns = std::max<std::int64_t>(deadline_ns - live_now_ns(), 0);
  const timespec timeout{.tv_sec = left_ns / 1'000'000'000, .tv_nsec = left_ns % 1'000'000'000};
  if (::ppoll(polled.data(), polled.size(), &timeout, nullptr) <= 0) return;
  for (std::size_t i = 0; i < buses.size(); ++i) {
    if ((polled[i].revents & POLLOUT) != 0) buses[i]->flush();
  }
}

}  // namespace rotorloop
