// Time spent in a module, for the speed figures alone: the one place in the loop that reads a wall clock, and nothing that it
// measures ever feeds back. Costs two clock readings per use when on, a branch when off.
#pragma once
#include <chrono>
#include <cstdint>

namespace rotorloop::hil {

class CostMeter {
 public:
  CostMeter(bool on, std::int64_t& sum_ns) : on_(on), sum_ns_(sum_ns) {
    if (on_) start_ = std::chrono::steady_clock::now();
  }
  ~CostMeter() {
    if (on_) sum_ns_ += std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start_).count();
  }
  CostMeter(const CostMeter&) = delete;
  CostMeter& operator=(const CostMeter&) = delete;

 private:
  bool on_;
  std::int64_t& sum_ns_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace rotorloop::hil
