// Progress on stderr: one line that is redrawn when stderr is a terminal, else one line for each finished flight. Uses the
// wall clock: it tells a person how long to wait and has no part in any result.
#pragma once
#include <chrono>
#include <cstdio>
#include <mutex>
#include <string>

#include "bench/hil/flight/runner.hpp"

namespace rotorloop::cli {

enum class ProgressStyle { silent, lines, redrawn };

class ProgressLine final : public hil::Progress {
 public:
  // `out` is stderr but for tests; `redrawn` is for terminals.
  ProgressLine(ProgressStyle style, std::FILE* out) : style_(style), out_(out) {}
  ~ProgressLine() override;

  void begin(std::size_t flights, double virtual_s_total) override;
  void advance(double virtual_s) override;
  void finished(const hil::FlightResult& flight) override;
  void warn(const std::string& where, const std::string& what) override;
  void end() override;

 private:
  using Clock = std::chrono::steady_clock;
  void draw(Clock::time_point now);
  void erase();

  const ProgressStyle style_;
  std::FILE* const out_;
  std::mutex mutex_;
  std::size_t flights_ = 0, done_ = 0;
  double total_s_ = 0.0, flown_s_ = 0.0;
  Clock::time_point begun_{}, drawn_{};
  bool on_screen_ = false;
};

// silent when quiet, redrawn when stderr is a terminal that can move its cursor, else lines.
ProgressStyle progress_style(bool quiet);

// 75 -> "1:15", 3700 -> "1:01:40"; rounds up, as a wait is better overestimated.
std::string duration_text(double seconds);

}  // namespace rotorloop::cli
