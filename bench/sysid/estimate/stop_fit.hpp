// How long work is asked to end early, from another thread or a signal handler, or because its time is over. A fit ends at its next
// iteration and gives back what it has, not converged; work that half done is worth nothing throws FitStopped, and its caller goes on with
// what was there before it.
#pragma once
#include <atomic>
#include <chrono>

namespace rotorloop::estimate {

// No std::exception: what takes a failed fit for an answer must not take this for one.
struct FitStopped {};

struct StopFit {
  using Clock = std::chrono::steady_clock;

  const std::atomic<bool>* flag = nullptr;              // none: never asked to stop
  Clock::time_point latest = Clock::time_point::max();  // then it ends, asked or not

  bool asked() const {
    return (flag && flag->load(std::memory_order_relaxed)) || (latest != Clock::time_point::max() && Clock::now() >= latest);
  }
  void check() const {
    if (asked()) throw FitStopped{};
  }
};

}  // namespace rotorloop::estimate
