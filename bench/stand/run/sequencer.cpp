#include "bench/stand/run/sequencer.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::stand_run {
namespace {

constexpr std::int64_t kZeros_ns = 300'000'000;  // of zero orders before the disarming
constexpr double kJump = 0.25;                   // of the higher speed: larger changes are slewed

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

}  // namespace

void Sequencer::begin(std::int64_t now) {
  phase_ = Phase::running;
  segment_ns_ = last_ns_ = now;
}

void Sequencer::hold_speed() {
  ceiling_ = ceiling_ > 0.0 ? std::min(ceiling_, set_point_) : std::max(set_point_, 1.0);
  limited_ = true;
}

void Sequencer::advance(std::int64_t now, bool rests) {
  const double reach = options_.slew_rad_s2 * seconds(now - last_ns_);
  last_ns_ = now;
  if (phase_ == Phase::done) return;
  if (phase_ == Phase::stopping) {
    set_point_ = 0.0;
    if (now - stopping_ns_ >= kZeros_ns) phase_ = Phase::done;
    return;
  }
  segment_over_ = false;
  const bool runs = phase_ == Phase::running;
  const double wanted = runs ? follow_plan(now, rests) : 0.0;
  if (segment_over_) return next_segment(now);
  const bool jump = runs && set_point_ > 0.0 && wanted > 0.0 && std::abs(wanted - set_point_) <= kJump * std::max(wanted, set_point_);
  set_point_ = jump ? wanted : set_point_ + std::clamp(wanted - set_point_, -reach, reach);
  if (!runs && set_point_ <= 0.0) stop(now);
}

double Sequencer::follow_plan(std::int64_t now, bool rests) {
  const Segment& s = segment();
  const double since = seconds(now - segment_ns_);
  double wanted = wanted_rad_s(plan_, s, since);
  if (ceiling_ > 0.0 && wanted > ceiling_) {
    wanted = ceiling_;
    limited_ = true;
  }
  const bool is_rest = s.motion == Motion::hold || s.motion == Motion::zero;
  const double at_least_s = s.motion == Motion::zero ? 3.0 * options_.settle_s : options_.settle_s;
  if (is_rest && !measuring() && since >= at_least_s && std::abs(set_point_ - wanted) < 1e-6) {
    settled_ = rests;
    if (settled_ || since >= at_least_s + options_.settle_most_s) {
      measure_ns_ = now;
      step_ = s.measured ? steps_begun_++ : -1;
    }
  }
  segment_over_ = is_rest ? measuring() && seconds(now - measure_ns_) >= s.duration_s : since >= s.duration_s;
  return wanted;
}

void Sequencer::next_segment(std::int64_t now) {
  step_ = -1;
  measure_ns_ = -1;
  limited_ = false;
  segment_ns_ = now;
  if (segment_ + 1 < plan_.segments.size())
    ++segment_;
  else
    stop(now);
}

}  // namespace rotorloop::stand_run
