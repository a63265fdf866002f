// The RPM loop, every sixth sample (4 kHz at 24 kHz): model following with torque feed-forward. A first-order model of the wanted speed
// supplies both the reference of the feedback and the inertial feed-forward; propeller torque is fed forward too, so the integral carries
// only what is not known. While a limiter acts the model is held at the measured speed and the integral may not grow in the blocked
// direction: nothing winds up, and the exit from the limit starts from the truth.
#pragma once
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/limits.hpp"

namespace rotorloop::firmware {

struct SpeedLoopConfig {
  float period_s = 250e-6f;
  float torque_constant_N_m_A = 0.0f;
  float inertia_kg_m2 = 0.0f;
  float load_N_m_s2 = 0.0f;
  float inertia_A_s2 = 0.0f, load_A_s2 = 0.0f;  // both over the torque constant
  float reference_rad_s = 500.0f;               // bandwidth of the model
  float feedback_rad_s = 400.0f;                // proportional action
  float integral_share = 0.25f;                 // corner of the integral, of the feedback
  float over_full_speed_s = 1.0f / 700.0f;  // 1 / rad/s: below this speed feedback falls with it, as the observer's own bandwidth does …
  float least_share = 0.15f;                // … to this share
  bool hold_at_limit = true;                // false only to show what the hold prevents
  float slew_rad_s2 = 0.0f;                 // of the set-point; 0: off
  float max_speed_rad_s = 0.0f, min_speed_rad_s = 0.0f;
  float over_fade_s = 0.0f;  // torque modes: 1 over the 2 % of the highest speed in which the torque fades out
};

struct SpeedLoopState {
  float slewed_rad_s = 0.0f;
  float model_rad_s = 0.0f;
  float integral_A = 0.0f;
};

struct SpeedLoopStep {
  float current_A = 0.0f;
  Limiter limiter = Limiter::none;
};

// voltage_limited: the current loop could not give what was asked of it.
inline SpeedLoopStep step(const SpeedLoopConfig& c, SpeedLoopState& s, float target_rad_s, float speed_rad_s, const CurrentRange& range,
                          bool voltage_limited) {
  Limiter reference_by = Limiter::none;
  float target = target_rad_s;
  if (magnitude(target) > c.max_speed_rad_s) target = sign_of(target) * c.max_speed_rad_s, reference_by = Limiter::max_speed;
  if (magnitude(target) < c.min_speed_rad_s) target = sign_of(target) * c.min_speed_rad_s, reference_by = Limiter::min_speed;
  float slew_rad_s2 = 0.0f;
  if (c.slew_rad_s2 > 0.0f) {
    const float most = c.slew_rad_s2 * c.period_s, change = clamp(target - s.slewed_rad_s, -most, most);
    if (change != target - s.slewed_rad_s) {
      reference_by = Limiter::speed_slew;
      slew_rad_s2 = sign_of(change) * c.slew_rad_s2;
    }
    s.slewed_rad_s += change;
  } else {
    s.slewed_rad_s = target;
  }
  const float share = clamp(magnitude(speed_rad_s) * c.over_full_speed_s, c.least_share, 1.0f);
  const float feedback = c.feedback_rad_s * share, reference = c.reference_rad_s * share;
  // On a ramp the model follows without lag: its own slope is fed in.
  const float slope_rad_s2 = reference * (s.slewed_rad_s - s.model_rad_s) + slew_rad_s2;
  const float model = s.model_rad_s + c.period_s * slope_rad_s2;
  const float feed_A = c.inertia_A_s2 * slope_rad_s2 + c.load_A_s2 * model * magnitude(model);
  const float kp_A_s = c.inertia_A_s2 * feedback;
  const float error = s.model_rad_s - speed_rad_s;
  const float wanted_A = feed_A + kp_A_s * error + s.integral_A;
  const Limited limited = limit_current(range, wanted_A, sign_of(speed_rad_s));
  const bool held = c.hold_at_limit && (limited.by != Limiter::none || voltage_limited);
  if (held) {
    s.model_rad_s = speed_rad_s;
    // Integral: only towards relief.
    const float blocked = voltage_limited && limited.by == Limiter::none ? wanted_A : wanted_A - limited.current_A;
    if (error * blocked < 0.0f) s.integral_A += kp_A_s * c.integral_share * feedback * c.period_s * error;
  } else {
    s.model_rad_s = model;
    s.integral_A += kp_A_s * c.integral_share * feedback * c.period_s * error;
  }
  return {limited.current_A, limited.by != Limiter::none ? limited.by : voltage_limited ? Limiter::voltage : reference_by};
}

// Makes the loop continue from a speed and a current that something else was holding.
inline void enter(const SpeedLoopConfig& c, SpeedLoopState& s, float speed_rad_s, float current_A) {
  s.slewed_rad_s = s.model_rad_s = speed_rad_s;
  s.integral_A = current_A - c.load_A_s2 * speed_rad_s * magnitude(speed_rad_s);
}

}  // namespace rotorloop::firmware
