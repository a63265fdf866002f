// How long work is asked to end early, from another thread or a signal handler, or because its iterations are spent. A fit ends at its next
// iteration and gives back what it has, not converged; work that half done is worth nothing throws FitStopped, and its caller goes on with
// what was there before it.
#pragma once
#include <atomic>

namespace rotorloop::estimate {

// No std::exception: what takes a failed fit for an answer must not take this for one.
struct FitStopped {};

struct StopFit {
  const std::atomic<bool>* flag = nullptr;  // none: never asked to stop
  // Of all fits that share it, one after the other; below 0 one more was wanted, and they end. Counted, not timed: what a fit comes to
  // must not hang on how busy the machine is. None: as many as each may.
  int* iterations_left = nullptr;

  bool asked() const { return (flag && flag->load(std::memory_order_relaxed)) || (iterations_left && *iterations_left < 0); }
  // Before each iteration: whether it is not to begin.
  bool asked_at_iteration() const {
    if (iterations_left) --*iterations_left;
    return asked();
  }
  void check() const {
    if (asked()) throw FitStopped{};
  }
};

}  // namespace rotorloop::estimate
