// The clock of all live buses of a process, and waiting on several of them.
#pragma once
#include <cstdint>
#include <ctime>
#include <span>

#include "host/bus/timed_bus.hpp"

namespace rotorloop {

// Nanoseconds since 1970 when the process first asked, and steadily on from there: setting the system's clock does not move it.
std::int64_t live_now_ns();

// How long ago the system put this stamp of its clock on what it received; 0 for none, and where someone set that clock.
std::int64_t stamp_age_ns(const timespec& stamp);

// Returns when one of these buses has input, at the deadline, or at a signal. Flushes their output meanwhile. All need descriptors.
// `descriptor`: one more to wait on, or -1.
void wait_for_any(std::span<TimedBus* const> buses, std::int64_t deadline_ns, int descriptor = -1);

}  // namespace rotorloop
