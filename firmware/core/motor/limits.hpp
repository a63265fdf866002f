// Which torque currents are allowed now, and by which rule. Every rule narrows an interval; the one that binds is the one
// reported. Power rule for supplies: electrical power 3/2 R i² + Kt w i must stay within [-P_sink, P_source].
#pragma once
#include <cmath>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/angle.hpp"
#include "firmware/core/motor/motor_scale.hpp"

namespace rotorloop::firmware {

struct PowerLimitConfig {
  float resistance_ohm = 0.0f;
  float torque_constant_N_m_A = 0.0f;  // 3/2 p flux
  float over_3_ohm = 1.0f / (3.0f * resistance_ohm);
};

struct CurrentRange {
  float low_A = 0.0f, high_A = 0.0f;
  Limiter low_by = Limiter::phase_current, high_by = Limiter::phase_current;
  // Braking harder than this burns all recovered power in the winding and is allowed again; -infinity when no such branch.
  float gap_far_A = 0.0f, gap_near_A = 0.0f;  // forbidden open interval (far, near) on the braking side, in the direction of motion
  bool has_gap = false;
};

// Roots of 3/2 R i² + k i + p = 0 (k = Kt w).
struct SinkGap {
  bool exists = false;
  float far_A = 0.0f, near_A = 0.0f;  // both <= 0 for k > 0
};

inline SinkGap sink_gap(const PowerLimitConfig& c, float speed_rad_s, float sink_W) {
  const float k = c.torque_constant_N_m_A * magnitude(speed_rad_s), r6 = 6.0f * c.resistance_ohm;
  const float discriminant = k * k - r6 * sink_W;
  if (discriminant <= 0.0f) return {};
  const float root = std::sqrt(discriminant);
  return {true, (-k - root) * c.over_3_ohm, (-k + root) * c.over_3_ohm};
}

inline float source_limit_A(const PowerLimitConfig& c, float speed_rad_s, float source_W) {
  const float k = c.torque_constant_N_m_A * magnitude(speed_rad_s), r6 = 6.0f * c.resistance_ohm;
  return (-k + std::sqrt(k * k + r6 * source_W)) * c.over_3_ohm;
}

struct LimitInputs {
  float speed_rad_s = 0.0f;
  float bus_V = 0.0f;
  float temperature_K = 0.0f;
  float current_d_A = 0.0f;
  float share = 1.0f;  // of the phase limit that is left after faults
};
constexpr float kDeratingSpan_V = 1.2f;   // 0.3 V per cell of a 4-cell pack, where the cells are not known
constexpr float kBrakeResistance = 0.8f;  // of it that is counted on: it is known to ±20 %
constexpr float kShareAfterOne = 0.75f, kShareAfterMore = 0.5f;
struct LimitConfig {
  Limiter phase_by = Limiter::phase_current;  // which of the two
  PowerLimitConfig power{1.0f};
  PowerLimitConfig brake{1.0f};  // the resistance that is counted on as a brake resistor
  float burnt_ohm = 1.5f;        // what a d current is burnt in: 3/2 R
  // Current that is asked for: a share of the phase limit, so that ripple, noise and shunt tolerance stay inside the limit …
  float asked_A = 0.0f, source_A = 0.0f, sink_A = 0.0f;
  // … and no more than the board can measure, less per volt of bus what the current moves before the loop answers, or what it swings beyond
  // what is asked if that is more: the smaller of the two, worked out anew at each start from the bus that it finds (hold_to_range()).
  float range_A = 1e9f, range_A_V = 0.0f, swing_A = 0.0f;
  // Of asked_A: without a fault, after one, after more. What tripped once trips again in the same way, until a second without has passed.
  float share = 1.0f, share_after_one = kShareAfterOne, share_after_more = kShareAfterMore;
  float undervoltage_V = 0.0f, over_undervoltage_span = 1.0f / kDeratingSpan_V;
  float temperature_K = 0.0f, over_temperature_span = 1.0f / 20.0f;
  float observer_A_s_rad = 0.0f, observer_min_A = 0.0f;  // |i_q| <= max(min, slope·|speed|): resistance error against back-EMF
};

// Range in the direction of motion (positive drives), then mirrored by the caller's sign.
inline CurrentRange current_range(const LimitConfig& c, const LimitInputs& in) {
  CurrentRange r{.low_by = c.phase_by, .high_by = c.phase_by};
  const float phase_A = c.asked_A * in.share;
  const float d2_A2 = in.current_d_A * in.current_d_A, room2 = phase_A * phase_A - d2_A2;
  const float phase = room2 > 0.0f ? std::sqrt(room2) : 0.0f;
  r.high_A = phase;
  r.low_A = -phase;
  const auto lower = [&](float limit, Limiter by, bool both) {
    if (limit < r.high_A) {
      r.high_A = limit;
      r.high_by = by;
    }
    if (both && -limit > r.low_A) {
      r.low_A = -limit;
      r.low_by = by;
    }
  };
  const float trusted = c.observer_A_s_rad * magnitude(in.speed_rad_s);
  lower(trusted > c.observer_min_A ? trusted : c.observer_min_A, Limiter::observer, true);
  lower(phase * clamp((c.temperature_K - in.temperature_K) * c.over_temperature_span, 0.0f, 1.0f), Limiter::temperature, true);
  lower(phase * clamp((in.bus_V - c.undervoltage_V) * c.over_undervoltage_span, 0.0f, 1.0f), Limiter::undervoltage, false);
  // What the d current burns is not available to, and need not be returned by, the torque current.
  const float burnt_W = c.burnt_ohm * d2_A2;
  const float source_W = c.source_A * in.bus_V - burnt_W;
  lower(source_limit_A(c.power, in.speed_rad_s, source_W > 0.0f ? source_W : 0.0f), Limiter::bus_current, false);
  const SinkGap gap = sink_gap(c.brake, in.speed_rad_s, c.sink_A * in.bus_V);
  r.has_gap = gap.exists;
  r.gap_far_A = gap.far_A;
  r.gap_near_A = gap.near_A;
  return r;
}

struct Limited {
  float current_A = 0.0f;
  Limiter by = Limiter::none;
};

// direction: +1 or -1, the sense of rotation; wanted_A: torque current, signed.
inline Limited limit_current(const CurrentRange& r, float wanted_A, float direction) {
  float x = wanted_A * direction;
  Limiter by = Limiter::none;
  if (x > r.high_A) {
    x = r.high_A;
    by = r.high_by;
  }
  if (x < r.low_A) {
    x = r.low_A;
    by = r.low_by;
  }
  if (r.has_gap && x < r.gap_near_A && x > r.gap_far_A) {
    x = r.gap_near_A;
    by = Limiter::regen_current;
  }
  return {x * direction, by};
}

// Shares tuned on the simulated drive, 2026-11-23. A 20 % error of R must stay below 40 % of the back-EMF: 0.2 R i < 0.4 w_e flux.
constexpr float kObserverLimit = 2.0f, kObserverLeast = 0.5f;  // of w_e flux / R; of the start current

constexpr float kAskedShare = 0.9f;  // of the phase limit
// What a phase of the board can be asked for. Of the trip: gains 3 % apart, zeros off by 20 counts, and what the bus moves through the
// winding in one sample by this share of its voltage, which an angle, an EMF or a dead time that is not as known can put there before the
// loop answers. Flights on plants of two hands; 2026-11-28. With a large inductance that is little; but at the end of a swing from one
// limit to the other the frame still turns by what the inductance has wrong, and braking at speed the voltage may not do for what turns
// with L i: the current goes beyond what is asked by this share of the trip. 64 boards of a 320 rpm/V motor; 2026-11-29.
constexpr float kRangeGains = 0.97f, kRangeZero_counts = 20.0f, kUnansweredShare = 0.07f, kSwingShare = 0.135f;

constexpr float range_limit_A(const LimitConfig& c, float bus_V) {
  const float moved_A = c.range_A_V * bus_V;
  return c.range_A - (moved_A > c.swing_A ? moved_A : c.swing_A);
}
constexpr void hold_to_range(LimitConfig& c, float bus_V) {
  const float range_A = range_limit_A(c, bus_V);
  c.phase_by = range_A < c.asked_A ? Limiter::sensor_range : Limiter::phase_current;
  c.share = range_A < c.asked_A ? range_A / c.asked_A : 1.0f;
  c.share_after_one = kShareAfterOne * c.share;
  c.share_after_more = kShareAfterMore * c.share;
}

template <Board B>
constexpr void configure_range(const Parameters& p, float period_s, LimitConfig& l) {
  l.range_A = kRangeGains * B::kTripCurrent_A - kRangeZero_counts * magnitude(B::kCurrent_A_per_count);
  l.swing_A = kSwingShare * B::kTripCurrent_A;
  l.range_A_V = kUnansweredShare * period_s / p.inductance_H;
}

constexpr void configure_limits(const Parameters& p, const MotorScale& m, float resistance_ohm, LimitConfig& l) {
  l.power = {resistance_ohm, m.torque_constant_N_m_A};
  l.brake = {kBrakeResistance * resistance_ohm, m.torque_constant_N_m_A};
  l.burnt_ohm = 1.5f * resistance_ohm;
  l.asked_A = kAskedShare * p.phase_current_limit_A;
  l.source_A = p.bus_current_limit_A;
  l.sink_A = p.regen_current_limit_A;
  l.undervoltage_V = undervoltage_V(p);
  l.over_undervoltage_span = 1.0f / (p.cells > 0 ? kDeratingPerCell_V * static_cast<float>(p.cells) : kDeratingSpan_V);
  l.temperature_K = p.temperature_limit_K;
  l.observer_A_s_rad = kObserverLimit * static_cast<float>(p.pole_pairs) * p.flux_linkage_Wb / resistance_ohm;
  l.observer_min_A = kObserverLeast * m.start_A;
}

}  // namespace rotorloop::firmware
