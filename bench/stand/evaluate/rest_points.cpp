#include "bench/stand/evaluate/rest_points.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::stand {
namespace {

constexpr double kLoadedThrust = 0.1;    // of the largest thrust: above, a load
constexpr double kLoadedCurrent = 0.03;  // the same of the current, which goes about with the power 1.5 of the thrust
constexpr double kLeastCurrent_A = 0.1;  // noise of a sensor at rest
constexpr double kMostUntared = 0.25;    // of the largest thrust: a larger reading at rest is taken with a current alone

}  // namespace

bool RestPoints::shows_no_speed(const StandPoint& p) const {
  for (std::size_t k = 0; k < rotors_; ++k)
    if (!(p.omega_rad_s[k] <= kAtRest_rad_s)) return false;
  return true;
}

RestPoints::RestPoints(const StandRecord& record) : rotors_(record.rotors) {
  double low_A = HUGE_VAL, high_A = -HUGE_VAL;
  for (const StandPoint& p : record.points) {
    if (p.thrust_N == p.thrust_N) largest_N_ = std::max(largest_N_, std::abs(p.thrust_N));
    if (p.current_A == p.current_A) high_A = std::max(high_A, p.current_A);
    if (p.current_A == p.current_A && shows_no_speed(p)) low_A = std::min(low_A, p.current_A);
  }
  // A current that is the same in all rows was not measured.
  if (high_A > low_A && std::isfinite(low_A)) {
    rest_A_ = low_A;
    loaded_A_ = std::max(kLoadedCurrent * (high_A - low_A), kLeastCurrent_A);
  }
  double least_N = kNotMeasured;
  for (const StandPoint& p : record.points)
    if (shows_no_speed(p) && !draws_current(p) && p.thrust_N == p.thrust_N && !(std::abs(p.thrust_N) >= std::abs(least_N)))
      least_N = p.thrust_N;
  if (rest_A_ == rest_A_ ? least_N == least_N : std::abs(least_N) < kMostUntared * largest_N_) rest_N_ = least_N;
}

bool RestPoints::draws_current(const StandPoint& p) const {
  return rest_A_ == rest_A_ && p.current_A == p.current_A && p.current_A - rest_A_ > loaded_A_;
}

bool RestPoints::pulls(const StandPoint& p) const {
  const bool may_turn = rest_A_ != rest_A_ || p.current_A != p.current_A || draws_current(p);
  return may_turn && largest_N_ > 0.0 && std::abs(p.thrust_N - rest_N_) > kLoadedThrust * largest_N_;
}

}  // namespace rotorloop::stand
