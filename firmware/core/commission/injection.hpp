// Inductance along one axis of the stator at rest. The current is led up and down between two values on one side of zero, by voltages that
// make each way take about as many samples. Resistance, dead time and diodes depend on the current alone and both ways pass the same
// currents, so they drop out of the difference: change = T/L · (volts - R i) · samples - const · samples, with a constant for either sign
// of the current, as a zero that drifted adds to one and takes from the other. Bursts on either side of zero in the order + - - + leave the
// rotor where and as slow as it was.
#pragma once
#include <cstdint>

#include "firmware/core/commission/least_squares.hpp"
#include "firmware/core/motor/angle.hpp"

namespace rotorloop::firmware {

struct InjectionConfig {
  float low_A = 0.0f, high_A = 0.0f;
  float most_V = 0.0f;          // along the axis
  float resistance_ohm = 0.0f;  // about
  float emf_V_A = 0.0f;         // back-EMF along the axis per sum of the currents, about: across the magnet the rotor gives way
  // Samples of a way. The voltage follows a sample by two: a way is turned when its slope leads to the band's end by then, unless noise
  // would hide it.
  std::uint32_t least_samples = 5, slow_samples = 7;
  float delay_samples = 2.0f;
  // A band not much wider than the noise reaches through zero instead, to as much on the other side, and what a leg loses is taken off.
  bool noisy = false;
  float lost_V = 0.0f, zone_A = 1.0f;  // along the axis; current within which it rises
  std::uint32_t burst_samples = 24;
  std::uint32_t rows = 40;            // ways measured
  std::uint32_t most_samples = 6000;  // given up after
};

struct InjectionState {
  struct Way {
    std::uint32_t number = 0;
    float sign = 1.0f;
    bool counts = false;  // begins and ends within the band
  };
  float up_V = 0.0f, down_V = 0.0f;
  bool rising = true;
  float sign = 1.0f;
  std::uint32_t burst = 0, in_burst = 0, in_way = 0, samples = 0, rows = 0;
  Way pending{}, active{}, measured{};  // as voltages pass through the interrupt's pipeline
  float turning_A = 0.0f;               // sum of the current: what has set the rotor in motion
  float before_A = 0.0f, last_A = 0.0f, begin_A = 0.0f, volt_samples = 0.0f, emf_samples = 0.0f, way_samples = 0.0f;
};

struct InjectionStep {
  float v_V = 0.0f;
  bool done = false, failed = false;
};

// The period that ended belongs to a way; a way that is over becomes a row.
inline void account(const InjectionConfig& c, InjectionState& s, LeastSquares<4>& fit, float along_A, float duty_V) {
  const InjectionState::Way ended = s.active;
  if (ended.number != s.measured.number) {
    // Ways that took long, while the voltages were being found, say more of the resistance than of the inductance.
    if (s.measured.counts && s.way_samples >= 4.0f && s.way_samples <= 3.0f * static_cast<float>(c.slow_samples)) {
      const bool above = s.measured.sign > 0.0f;
      fit.add({s.volt_samples, above ? s.way_samples : 0.0f, above ? 0.0f : s.way_samples, -s.emf_samples}, s.last_A - s.begin_A);
      ++s.rows;
    }
    s.measured = ended;
    s.begin_A = s.last_A;
    s.volt_samples = s.way_samples = s.emf_samples = 0.0f;
  }
  const float mean_A = 0.5f * (along_A + s.last_A);
  s.turning_A += mean_A;
  const float emf_V = c.emf_V_A * s.turning_A, lost_V = c.lost_V * clamp(mean_A / c.zone_A, -1.0f, 1.0f);
  s.volt_samples += duty_V - c.resistance_ohm * mean_A - lost_V - emf_V;
  s.emf_samples += emf_V;
  s.way_samples += 1.0f;
  s.last_A = along_A;
}

// How the rotor gives way is known to a half; the ways say the rest where it matters. `noise_A`: of a way's change.
inline float inductance_H(LeastSquares<4> fit, float about_H, float period_s, float noise_A) {
  fit.add({0.0f, 0.0f, 0.0f, noise_A * about_H / (0.5f * period_s)}, 0.0f);
  if (!(fit.r[2][2] > 0.0f)) fit.add({0.0f, 0.0f, fit.r[0][0], 0.0f}, 0.0f);  // no way below zero
  std::array<float, 4> x{};
  return fit.solve(x) && x[0] > 0.0f ? period_s / x[0] : 0.0f;
}

inline void turn(InjectionState& s, bool counts) {
  s.pending = {s.pending.number + 1u, s.sign, counts};
  s.in_way = 0;
}

// One sample. along_A: measured now; duty_V: along the axis, what was told to the gates for the period that ends now. The result of
// `fit`: T/L, what dead time and drift take above and below zero, and by how much more the rotor gives way.
inline InjectionStep step(const InjectionConfig& c, InjectionState& s, LeastSquares<4>& fit, float along_A, float duty_V) {
  if (s.up_V <= 0.0f) s.up_V = 0.05f * c.most_V;
  if (s.samples == 0) s.last_A = along_A;
  account(c, s, fit, along_A, duty_V);
  s.active = s.pending;
  ++s.samples;
  ++s.in_burst;
  ++s.in_way;
  const float slope_A = s.in_way > 2 ? s.sign * (along_A - s.before_A) : 0.0f;  // the first two still go the other way
  s.before_A = along_A;
  const float i = s.sign * along_A + c.delay_samples * slope_A, nudge_V = 0.02f * c.most_V + 0.1f * magnitude(s.up_V - s.down_V);
  const bool slow = s.in_way > c.slow_samples && s.in_way % 3 == 0, fast = s.in_way < c.least_samples;
  if (s.rising) {
    if (slow) s.up_V = clamp(s.up_V + nudge_V, 0.0f, c.most_V);
    if (i >= c.high_A) {
      if (fast) s.up_V -= nudge_V;
      s.rising = false;
      turn(s, true);
    }
  } else {
    if (slow) s.down_V = clamp(s.down_V - nudge_V, -c.most_V, c.most_V);
    if (i <= c.low_A) {
      if (fast) s.down_V += nudge_V;
      s.rising = true;
      bool counts = true;
      if (s.in_burst >= c.burst_samples && !c.noisy) {
        s.in_burst = 0;
        const float before = s.sign;
        s.sign = (++s.burst & 3u) == 1u || (s.burst & 3u) == 2u ? -1.0f : 1.0f;
        counts = s.sign == before;
      }
      turn(s, counts);
    }
  }
  InjectionStep out;
  out.v_V = s.sign * (s.rising ? s.up_V : s.down_V);
  out.done = s.rows >= c.rows;
  out.failed = s.samples > c.most_samples;
  return out;
}

}  // namespace rotorloop::firmware
