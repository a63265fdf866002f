// What a process can ask of the system so that it runs when it has to, and a clock to wait on.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace rotorloop {

// What was granted ("SCHED_FIFO 50"), and for each refusal a sentence with its reason and the remedy.
struct RealTimeGrants {
  std::vector<std::string> granted, refused;
};

// For the calling thread: SCHED_FIFO; all memory locked; a CPU of its own, where the system has set one aside (isolcpus).
RealTimeGrants ask_for_real_time();

// Monotonic time on which one can wait. Tests put a clock of their own in its place.
class WaitClock {
 public:
  virtual ~WaitClock() = default;
  virtual std::int64_t now_ns();
  // Until the deadline; at once when it has passed.
  virtual void wait_until(std::int64_t deadline_ns);
};

}  // namespace rotorloop
