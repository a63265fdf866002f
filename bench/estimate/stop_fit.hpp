// How long work is asked to end early, from another thread or a signal handler. A fit ends at its next iteration and gives back what it
// has, not converged; work that half done is worth nothing throws FitStopped, and its caller goes on with what was there before it.
#pragma once
#include <atomic>

namespace rotorloop::estimate {

// No std::exception: what takes a failed fit for an answer must not take this for one.
struct FitStopped {};

struct StopFit {
  const std::atomic<bool>* flag = nullptr;  // none: never asked to stop

  bool asked() const { return flag && flag->load(std::memory_order_relaxed); }
  void check() const {
    if (asked()) throw FitStopped{};
  }
};

}  // namespace rotorloop::estimate
