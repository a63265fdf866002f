// The RPM loop, every sixth sample (4 kHz at 24 kHz): model following with torque feed-forward. A first-order model of the wanted speed
// supplies both the reference of the feedback and the inertial feed-forward; propeller torque is fed forward too, so the integral carries
// only what is not known. While a limiter acts the model is held at the measured speed and the integral may not grow in the blocked
// direction: nothing winds up, and the exit from the limit starts from the truth.
#pragma once
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/limits.hpp"
#include "firmware/core/motor/motor_scale.hpp"
#include "firmware/core/motor/timing.hpp"

namespace rotorloop::firmware {

// The gains of the RPM loop, all of them; docs/decisions/0013 has the reasons, docs/acceptance/esc_rpm_loop.md what they reach.
// Tuned on the simulated drive, 2026-11-23 where no other date stands.
constexpr float kFeedbackShare =
    1.62f;  // of the electromechanical frequency (motor_scale.hpp): 400 rad/s at 247 rad/s, the reference motor
// A thirtieth of the sampling's rate at most, 800 rad/s at 24 kHz, which a 3-inch motor reaches; 2026-11-25.
constexpr float kLeastFeedback_rad_s = 100.0f, kFeedbackOfSampling = 0.0333f, kLeastMost_rad_s = 200.0f, kMostFeedback_rad_s = 1000.0f;
constexpr float kReference = 1.25f;        // bandwidth of the model, of the feedback
constexpr float kIntegral = 0.25f;         // corner of the integral, of the feedback; 2026-11-21
constexpr float kSpeedCorner = 0.75f;      // of the observer's mechanical model, of the feedback: observer.hpp says why it is low
constexpr float kFullFeedback = 12.25f;    // electrical speed below which feedback falls with it, of the feedback …
constexpr float kLeastFeedback = 0.15f;    // … to this share, as the observer's own bandwidth does; 2026-11-21
constexpr float kTorqueFadeShare = 0.02f;  // of the highest speed, in which the torque of the torque modes fades out

struct SpeedLoopConfig {
  float period_s = 0.0f;
  float inertia_A_s2 = 0.0f, load_A_s2 = 0.0f;  // both over the torque constant
  float reference_rad_s = 0.0f;                 // bandwidth of the model
  float feedback_rad_s = 0.0f;                  // proportional action
  float integral_share = kIntegral;
  float over_full_speed_s = 0.0f;  // 1 / rad/s
  bool hold_at_limit = true;       // false only to show what the hold prevents
  float slew_rad_s2 = 0.0f;        // of the set-point; 0: off
  float max_speed_rad_s = 0.0f, min_speed_rad_s = 0.0f;
  float over_fade_s = 0.0f;  // torque modes: 1 over the speed in which the torque fades out
};

constexpr void configure_speed_loop(const Parameters& p, const MotorScale& m, float period_s, SpeedLoopConfig& s) {
  s.period_s = period_s * static_cast<float>(kSlots);
  s.inertia_A_s2 = p.inertia_kg_m2 / m.torque_constant_N_m_A;
  s.load_A_s2 = p.load_N_m_s2 / m.torque_constant_N_m_A;
  const float most_rad_s = clamp(kFeedbackOfSampling / period_s, kLeastMost_rad_s, kMostFeedback_rad_s);
  s.feedback_rad_s = clamp(kFeedbackShare * m.electromechanical_rad_s, kLeastFeedback_rad_s, most_rad_s);
  s.reference_rad_s = kReference * s.feedback_rad_s;
  s.over_full_speed_s = static_cast<float>(p.pole_pairs) / (kFullFeedback * s.feedback_rad_s);
  s.slew_rad_s2 = p.speed_slew_rad_s2;
  s.max_speed_rad_s = p.max_speed_rad_s;
  s.min_speed_rad_s = p.min_speed_rad_s;
  s.over_fade_s = 1.0f / (kTorqueFadeShare * p.max_speed_rad_s);
}

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
  if (magnitude(target) > c.max_speed_rad_s) {
    target = sign_of(target) * c.max_speed_rad_s;
    reference_by = Limiter::max_speed;
  }
  if (magnitude(target) < c.min_speed_rad_s) {
    target = sign_of(target) * c.min_speed_rad_s;
    reference_by = Limiter::min_speed;
  }
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
  const float share = clamp(magnitude(speed_rad_s) * c.over_full_speed_s, kLeastFeedback, 1.0f);
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
