// Progress of `rotorloop identify` on stderr: on a terminal one line that is redrawn, else one line for each part. Uses the wall
// clock: it tells a person how long to wait and has no part in any result.
#pragma once
#include <chrono>
#include <cstdio>
#include <string>

#include "bench/identify/identify.hpp"
#include "host/cli/progress_line.hpp"

namespace rotorloop::cli {

class IdentifyProgressLine {
 public:
  IdentifyProgressLine(ProgressStyle style, std::FILE* out) : style_(style), out_(out), begun_(Clock::now()) {}
  ~IdentifyProgressLine() { erase(); }
  void operator()(const bench::IdentifyProgress& p);

 private:
  using Clock = std::chrono::steady_clock;
  void erase();

  const ProgressStyle style_;
  std::FILE* const out_;
  Clock::time_point begun_, part_begun_{};
  int part_ = 0;
  bool on_screen_ = false;
};

}  // namespace rotorloop::cli
