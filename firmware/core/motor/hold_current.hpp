// A current along the estimated magnet at low speed. It makes no torque, but keeps the phases away from the currents at which what the
// dead time takes is not known, which at these speeds is more than the back-EMF; and a rotor that the estimate leaves is pulled back.
#pragma once
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/motor_scale.hpp"

namespace rotorloop::firmware {

// Tuned on the simulated drive, 2026-11-23. Flights of 300 drawn 3-inch and 300 5-inch motors without a trip: 299 and 287; 0.6 of the start
// current 297 and 285, all of it 298 and 285; full up to 2.5 and gone at 5 times the hand-over's speed 300 and 277.
constexpr float kHold = 0.8f;                        // of the start current
constexpr float kHoldFull = 2.0f, kHoldNone = 4.0f;  // all of it below, nothing above: of the hand-over's speed

struct HoldConfig {
  float current_A = 0.0f;
  float none_rad_s = 1.0f, over_fade_s = 1.0f;  // mechanical: nothing above; 1 over the speed in which it fades
  float most_step_A = 0.0f;                     // per supervision tick
};

constexpr float hold_current_A(const HoldConfig& c, float speed_rad_s) {
  return c.current_A * clamp((c.none_rad_s - magnitude(speed_rad_s)) * c.over_fade_s, 0.0f, 1.0f);
}

constexpr HoldConfig configure_hold(const MotorScale& m, float hand_over_rad_s, float hand_over_s, float tick_s) {
  const float none_rad_s = kHoldNone * hand_over_rad_s, fade_rad_s = none_rad_s - kHoldFull * hand_over_rad_s;
  return {kHold * m.start_A, none_rad_s, 1.0f / fade_rad_s, m.start_A * tick_s / hand_over_s};
}

}  // namespace rotorloop::firmware
