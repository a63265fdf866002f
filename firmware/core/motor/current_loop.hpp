// Currents to voltage in the rotor frame. Designed in discrete time for a one-period computing delay and a held stator voltage:
// seen from the turning frame the motor is  i' = a e^{-j phi} i + b e^{-j phi/2} u,  phi = electrical angle per period,
// so the controller  C(z) = K e^{+j phi/2} (1 - a e^{-j phi} z^-1) / (1 - z^-1)  leaves the loop b K z^-2/(1 - z^-1): the same at
// standstill and at 200 keRPM, cross-coupling cancelled exactly. b K = 1/4 would put both poles at 0.5; it is 0.19 (poles 0.26 and 0.74,
// gain margin 5.3): salient rotors, saturation and data sheets make L wrong by ± 40 % along one axis, and the loop above is far slower.
// Windup: the integral is fed with the voltage that was really given (conditioning technique, Hanus 1987).
#pragma once
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/timing.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

struct CurrentLoopConfig {
  float gain_V_A = 0.0f;         // K
  float decay = 0.0f;            // a = exp(-R T/L)
  float flux_linkage_Wb = 0.0f;  // back-EMF feed-forward
  float period_s = 0.0f;
};
constexpr float kCurrentLoopGain = 0.19f;  // b K; tuned on the simulated drive, 2026-11-23 (docs/decisions/0011)

struct CurrentLoopState {
  Rotor integral_V{};
};
struct CurrentLoopStep {
  Rotor v_V{};
  bool limited = false;
};

struct FrameMotion {
  float omega_e_rad_s = 0.0f;
  Rotation half{};  // e^{j phi/2}
  Rotation full{};  // e^{j phi}
};

constexpr FrameMotion frame_motion(float omega_e_rad_s, float period_s) {
  const Rotation half = small_rotation(clamp(0.5f * omega_e_rad_s * period_s, -0.78f, 0.78f));
  return {omega_e_rad_s, half, half * half};
}

inline CurrentLoopStep step(const CurrentLoopConfig& c, CurrentLoopState& s, Rotor wanted_A, Rotor measured_A, const FrameMotion& frame,
                            bool feed_forward, float limit_V) {
  const Rotor emf_V{0.0f, feed_forward ? frame.omega_e_rad_s * c.flux_linkage_Wb : 0.0f};
  const Rotor proportional_V = frame.half * (c.gain_V_A * (wanted_A - measured_A));
  CurrentLoopStep out{emf_V + s.integral_V + proportional_V, false};
  const float size = length(out.v_V);
  if (size > limit_V) {
    out.v_V = (limit_V / size) * out.v_V;
    out.limited = true;
  }
  const Rotor fed_V = out.v_V - emf_V - s.integral_V;  // the proportional part that was given
  const Rotor aged = c.decay * (conjugate(frame.full) * fed_V);
  s.integral_V = s.integral_V + fed_V - aged;
  return out;
}

constexpr CurrentLoopConfig configure_current_loop(const Parameters& p, float resistance_ohm, float period_s) {
  const float decay = exp_minus(resistance_ohm * period_s / p.inductance_H);
  return {kCurrentLoopGain * resistance_ohm / (1.0f - decay), decay, p.flux_linkage_Wb, period_s};
}

}  // namespace rotorloop::firmware
