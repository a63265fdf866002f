// The clock of all live buses of a process, and waiting on several of them.
#pragma once
#include <cstdint>
#include <ctime>
#include <span>

#include "host/bus/timed_bus.hpp"

namespace rotorloop {

// Nanoseconds since 1970 when the process first asked, and steadily on from there: setting the system's clock does not move it.
std::int64_t live_now_ns();

// When something happened that the system stamped by its own clock (CLOCK_REALTIME) less than a second ago; now where someone set that.
std::int64_t live_time_ns(const timespec& stamp);

// Returns when one of these buses has input, at the deadline, at a signal, or when output is to be tried again. Flushes their output
// meanwhile. All need descriptors; one of -1 (a bus that is not there now) is not waited on.
// `descriptor`: one more to wait on, or -1.
void wait_for_any(std::span<TimedBus* const> buses, std::int64_t deadline_ns, int descriptor = -1);

}  // namespace rotorloop
