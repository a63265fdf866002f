#include "host/base/real_time.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <fstream>

namespace rotorloop {
namespace {

constexpr int kPriority = 50;  // of 1 to 99: that of interrupt threads of a PREEMPT_RT kernel, so that none of them waits for us for ever

std::int64_t to_ns(const timespec& t) { return static_cast<std::int64_t>(t.tv_sec) * 1'000'000'000 + t.tv_nsec; }

// The first CPU of a list as the kernel writes it ("2-3,6") that this process may use; -1: none.
int first_usable(const std::string& list, const cpu_set_t& usable) {
  const char* at = list.data();
  const char* const end = at + list.size();
  while (at < end) {
    int first = 0;
    auto [after, error] = std::from_chars(at, end, first);
    if (error != std::errc{}) return -1;
    int last = first;
    if (after < end && *after == '-') after = std::from_chars(after + 1, end, last).ptr;
    for (int cpu = first; cpu <= last && cpu < CPU_SETSIZE; ++cpu)
      if (CPU_ISSET(static_cast<std::size_t>(cpu), &usable)) return cpu;
    at = after + 1;
  }
  return -1;
}

// Only without a limit: with one, whatever is allocated beyond it later would fail in the middle of a flight.
void lock_memory(RealTimeGrants& out) {
  const rlimit unlimited{RLIM_INFINITY, RLIM_INFINITY};
  rlimit limit{};
  const bool free =
      setrlimit(RLIMIT_MEMLOCK, &unlimited) == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
  if (free && mlockall(MCL_CURRENT | MCL_FUTURE) == 0) {
    out.granted.emplace_back("memory locked");
    return;
  }
  const std::string why = free ? std::strerror(errno) : fmt::format("this process may lock {} KiB", limit.rlim_cur / 1024);
  out.refused.push_back(fmt::format("memory not locked: {}; allow it with ulimit -l unlimited", why));
}

void take_cpu(RealTimeGrants& out) {
  cpu_set_t usable;
  CPU_ZERO(&usable);
  std::ifstream file("/sys/devices/system/cpu/isolated");
  std::string list;
  std::getline(file, list);
  if (list.empty() || sched_getaffinity(0, sizeof usable, &usable) != 0) {
    out.refused.emplace_back("no CPU of its own: the kernel has set none aside; boot with isolcpus=N for it");
    return;
  }
  const int cpu = first_usable(list, usable);
  cpu_set_t own;
  CPU_ZERO(&own);
  if (cpu >= 0) CPU_SET(static_cast<std::size_t>(cpu), &own);
  if (cpu < 0 || sched_setaffinity(0, sizeof own, &own) != 0) {
    out.refused.push_back(fmt::format("no CPU of its own: this process may use none of those set aside ({}); start it with taskset", list));
    return;
  }
  out.granted.push_back(fmt::format("CPU {} of its own", cpu));
}

}  // namespace

RealTimeGrants ask_for_real_time() {
  RealTimeGrants out;
  const sched_param priority{.sched_priority = kPriority};
  if (sched_setscheduler(0, SCHED_FIFO, &priority) == 0)
    out.granted.push_back(fmt::format("SCHED_FIFO {}", kPriority));
  else
    out.refused.push_back(
        fmt::format("no SCHED_FIFO: {}; allow it with ulimit -r {}, or LimitRTPRIO= of systemd", std::strerror(errno), kPriority));
  lock_memory(out);
  take_cpu(out);
  return out;
}

std::int64_t WaitClock::now_ns() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return to_ns(t);
}

void WaitClock::wait_until(std::int64_t deadline_ns) {
  const timespec t{.tv_sec = deadline_ns / 1'000'000'000, .tv_nsec = deadline_ns % 1'000'000'000};
  while (deadline_ns > now_ns() && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace rotorloop
