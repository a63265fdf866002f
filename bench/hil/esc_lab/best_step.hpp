// What a motor can do at best within its current and voltage limits, from its true values alone: the yardstick of the study. No
// control: torque is at the limit until the speed is there.
#pragma once
#include "bench/hil/esc_lab/motor_classes.hpp"

namespace rotorloop::esc_lab {

// Highest speed that the draw holds for good: 90 % of the phase current limit, and of the linear range of the modulation what the
// sampling windows of the shunts leave; at most the ESC's own speed limit.
double highest_speed_rad_s(const EscDraw& draw);

struct BestStep {
  double rise_ms = 0.0;   // 10 to 90 %
  double reach_ms = 0.0;  // to within 2 %
};
BestStep best_step(const EscDraw& draw, double from_rad_s, double to_rad_s);

}  // namespace rotorloop::esc_lab
