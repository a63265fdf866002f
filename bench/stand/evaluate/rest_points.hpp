// Whether a rotor whose speed reads zero stands still: the current says so where it was measured, else the thrust against what the load
// cell reads at rest. A cell that was not tared reads the same at rest as a rotor that pulls.
#pragma once
#include "bench/stand/evaluate/stand_file.hpp"

namespace rotorloop::stand {

inline constexpr double kAtRest_rad_s = 20.0;  // below, a speed is noise of a probe at rest

class RestPoints {
 public:
  explicit RestPoints(const StandRecord& record);
  bool shows_no_speed(const StandPoint& p) const;
  bool at_rest(const StandPoint& p) const { return shows_no_speed(p) && !pulls(p); }
  // A rotor that loads the load cell and, where a current was measured, the motor.
  bool pulls(const StandPoint& p) const;

 private:
  bool draws_current(const StandPoint& p) const;
  std::size_t rotors_;
  double rest_A_ = kNotMeasured, loaded_A_ = 0.0;  // current at rest, and how far above it a motor is loaded
  double rest_N_ = 0.0, largest_N_ = 0.0;          // thrust at rest, and the largest size of any
};

}  // namespace rotorloop::stand
