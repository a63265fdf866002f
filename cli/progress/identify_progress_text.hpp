// What `rotorloop identify` says of its progress, from what the fit reports and the seconds since it began. No clock, so that a test
// can say what time it is. A time left is given only where the fit itself predicts it: with given noise, once what is left of the cost
// falls steadily. While the noise is searched too, nobody knows how many rounds it takes; there the most iterations are named instead.
#pragma once
#include <array>
#include <string>

#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::cli {

class IdentifyProgressText {
 public:
  explicit IdentifyProgressText(const estimate::FitOptions& fit) : fit_(fit) {}
  void goes_on_with(const estimate::FitOptions& fit) { fit_ = fit; }  // of the parts that follow

  struct Told {
    std::string text;
    bool due = false;  // a line of its own where lines stay: a part or round begins, or the last one is old
  };
  Told operator()(const identify::IdentifyProgress& p, double elapsed_s);

 private:
  // Seconds to the end of this round, below 0 where they cannot be predicted.
  double left_s(const estimate::FitProgress& p, double elapsed_s) const;

  estimate::FitOptions fit_;
  int part_ = 0, round_ = 1, iteration_ = -1;
  double round_begun_s_ = 0.0, last_line_s_ = 0.0;
  std::array<double, 3> to_fall_{};  // the last ones of this round, newest first
  int known_ = 0;                    // of them
};

}  // namespace rotorloop::cli
