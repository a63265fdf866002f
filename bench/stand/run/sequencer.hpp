// What comes next in a run: which segment of the plan, which set-point, when a hold counts, and how the motor is brought to rest. Knows
// times and speeds alone.
#pragma once
#include <cstdint>

#include "bench/stand/run/sequence.hpp"

namespace rotorloop::stand_run {

struct SequencerOptions {
  double settle_s = 0.7;        // at least, after each change of speed; zeros three times as long
  double settle_most_s = 5.0;   // then the step counts as it is, marked unsettled
  double slew_rad_s2 = 2000.0;  // of starts, stops and large changes
};

enum class Phase : std::uint8_t { waiting, running, ramping_down, stopping, done };

class Sequencer {
 public:
  // The plan must outlive it.
  Sequencer(const Plan& plan, const SequencerOptions& options) : plan_(plan), options_(options) {}
  void begin(std::int64_t now_ns);
  // To `now`; `rests`: speed and thrust have been steady for a while.
  void advance(std::int64_t now_ns, bool rests);
  // The stand is not in the configuration of this segment: it begins when it is.
  void wait(std::int64_t now_ns) {
    segment_ns_ = now_ns;
    measure_ns_ = -1;
  }
  void hold_speed();  // a limit: nothing above the present speed from now on
  void ramp_down() { phase_ = Phase::ramping_down; }
  void stop(std::int64_t now_ns) {
    phase_ = Phase::stopping;
    stopping_ns_ = now_ns;
  }  // zero at once
  void finish() { phase_ = Phase::done; }

  Phase phase() const { return phase_; }
  bool turning() const { return phase_ == Phase::running || phase_ == Phase::ramping_down; }
  double set_point_rad_s() const { return set_point_; }
  std::size_t segment_index() const { return segment_; }
  const Segment& segment() const { return plan_.segments[segment_]; }
  bool measuring() const { return measure_ns_ >= 0; }  // in a hold that has settled, or has had its time to
  int step() const { return step_; }                   // number of the hold that counts now; -1: none
  bool settled() const { return settled_; }
  bool limited() const { return limited_; }  // a limit holds this segment's speed down

 private:
  double follow_plan(std::int64_t now_ns, bool rests);
  void next_segment(std::int64_t now_ns);

  const Plan& plan_;
  SequencerOptions options_;
  Phase phase_ = Phase::waiting;
  double set_point_ = 0.0, ceiling_ = 0.0;  // ceiling 0: none
  std::size_t segment_ = 0;
  std::int64_t segment_ns_ = 0, measure_ns_ = -1, stopping_ns_ = 0, last_ns_ = 0;
  int step_ = -1, steps_begun_ = 0;
  bool settled_ = true, limited_ = false, segment_over_ = false;
};

}  // namespace rotorloop::stand_run
