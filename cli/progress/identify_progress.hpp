// Progress of `rotorloop identify` on stderr: on a terminal one line that is redrawn, else a line for each part and round and one
// every ten seconds between. Uses the wall clock: it tells a person how long to wait and has no part in any result.
#pragma once
#include <chrono>
#include <cstdio>

#include "cli/progress/identify_progress_text.hpp"
#include "cli/progress/progress_line.hpp"

namespace rotorloop::cli {

class IdentifyProgressLine {
 public:
  IdentifyProgressLine(ProgressStyle style, std::FILE* out, const estimate::FitOptions& fit)
      : style_(style), out_(out), text_(fit), begun_(Clock::now()) {}
  ~IdentifyProgressLine() { erase(); }
  void goes_on_with(const estimate::FitOptions& fit) { text_.goes_on_with(fit); }
  void operator()(const identify::IdentifyProgress& p);

 private:
  using Clock = std::chrono::steady_clock;
  void erase();

  const ProgressStyle style_;
  std::FILE* const out_;
  IdentifyProgressText text_;
  const Clock::time_point begun_;
  bool on_screen_ = false;
};

}  // namespace rotorloop::cli
