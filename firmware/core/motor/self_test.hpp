// Self-test of the bridge, once after power-up with the rotor at rest: is a FET open or short, is a phase off? Pulses that drive an ampere
// at most through what should not conduct, then through what should. A pure function of samples; the motor control applies what it says.
//
// Whatever gate closes first beside a shorted FET of its own leg shorts the supply, and no order avoids it for all. Leg A's low side is the
// first gate of all, so that of the high sides only A's is met like that: A's shunt is at its end in the same sample. Leg A's high side is
// the first high side, so that of the low sides only A's is met like that; no sample shows it, and leg B's pulses find it afterwards. All
// others are found by a current through the windings.
#pragma once
#include <cstdint>

#include "firmware/board/board.hpp"
#include "firmware/core/interface.hpp"
#include "firmware/core/motor/modulator.hpp"
#include "firmware/core/motor/timing.hpp"
#include "firmware/core/motor/vector.hpp"

namespace rotorloop::firmware {

struct SelfTestConfig {
  bool wanted = false;
  float top = 1.0f;                                       // compare of full duty
  float period_s = 0.0f, counts_s = 0.0f, pulses = 1.0f;  // of a sample; compare per second of on-time; PWM periods per sample
  float dead_counts = 0.0f, window_counts = 0.0f;         // dead time; low-side time before a sample
  float most_counts = 1.0f;                               // longest pulse that leaves the sample its window
  float line_ohm = 0.0f, line_H = 0.0f, diode_V = 0.0f;
  float left = 1.0f;                      // of what the pulses of a sample drive, when it is taken
  float wanted_A = 0.0f, least_A = 0.0f;  // what a pulse should reach; what stands clear of the noise
  float alone_A = 0.0f;                   // in one shunt alone: its leg shorts the supply
  std::uint16_t wait_ticks = 0;           // supervision ticks from a rotor that turned to the next try
  std::uint32_t late_us = 0;              // from one sample to the next: one was missed
};

enum class SelfTestStage : std::uint8_t { lows, which_high, rotation, highs, directions, pause };

// Lengths of the pulses at this supply, in counts of the compare.
struct SelfTestPlan {
  float seen_A = 0.0f;  // a current
  float low_first = 0.0f, high_first = 0.0f, step = 0.0f, low_last = 0.0f, high_last = 0.0f;
  float lag = 0.0f;           // of leg B's high side behind A's
  std::uint16_t samples = 1;  // of the longest pulse train; the shorter ones have one
  float drive_first = 0.0f, drive_step = 0.0f, drive_last = 0.0f;
  std::uint16_t hold = 0;  // samples at the end of the ramp
};

struct SelfTestVariables {
  SelfTest result = SelfTest::off;
  Broken broken = Broken::none;
  std::uint8_t leg = 0;
  bool under_way = false;
  std::uint16_t wait = 0;
  std::uint64_t last_us = 0;
  SelfTestPlan plan{};
  SelfTestStage stage = SelfTestStage::lows;
  std::uint8_t findings = 0;  // the same one twice in a row counts: a sample that was none is no fault
  std::uint16_t tick = 0;
  std::uint8_t index = 0, hits = 0, seen = 0, quiet = 0;
  float width = 0.0f;
  Phases sum{};
};

struct SelfTestStep {
  std::uint8_t gates = 0;
  PwmCompare compare{};  // acts from the next sample on, the gates at once
  bool done = false;
};

namespace self_test {

constexpr std::uint16_t kGap = 3, kLongGap = 24, kBlock = 16, kQuietBlocks = 4, kBlocks = 24, kPause = 120;
constexpr std::uint8_t kMostFindings = 5;

constexpr void enter(SelfTestVariables& s, SelfTestStage stage) {
  s.stage = stage;
  s.tick = 0;
  s.index = s.hits = s.quiet = 0;
  s.width = stage == SelfTestStage::directions ? s.plan.drive_first : stage == SelfTestStage::highs ? s.plan.high_first : s.plan.low_first;
  s.sum = {};
}

inline void begin(const SelfTestConfig& c, SelfTestVariables& s, float bus_V) {
  SelfTestPlan& p = s.plan;
  const float over_bus = 1.0f / (bus_V > 1.0f ? bus_V : 1.0f), counts_V = c.top * over_bus;
  // A motor of ohms takes no more than a third of what the supply could drive.
  const float able_A = 0.3f * bus_V / c.line_ohm;
  p.seen_A = c.wanted_A < able_A ? c.wanted_A : able_A > c.least_A ? able_A : c.least_A;
  // 0.3 A more with each train. At its end 2.5 times what the current needs: motors differ from their parameters.
  const float per_A = c.line_H * over_bus / (c.pulses * c.left) * c.counts_s, needed = 2.5f * p.seen_A * per_A;
  p.low_first = p.high_first = 0.4f * c.dead_counts + 0.3e-6f * c.counts_s;
  p.step = clamp(0.3f * per_A, 0.08e-6f * c.counts_s, 0.5e-6f * c.counts_s);
  // Before the sample lies half of a low pulse, less the dead time.
  p.low_last = 3.2f * c.dead_counts + (needed > 2.0f * c.window_counts ? needed : 2.0f * c.window_counts);
  p.high_last = 1.6f * c.dead_counts + needed;
  p.lag = 1.5f * p.seen_A * per_A;
  p.samples = 1;
  const float longest = 0.8f * c.most_counts;
  if (p.low_last > longest) {
    p.samples = static_cast<std::uint16_t>(clamp(needed / (longest - 2.0f * c.dead_counts) + 1.5f, 1.0f, 200.0f));
    p.high_first = p.low_last = p.high_last = longest;
    p.lag = 0.0f;  // A's only train says it all
  }
  // From leg to leg: as fast as one more sample adds 0.3 A, limited by resistance or by inductance.
  const float by_ohm_V = 0.3f * c.line_ohm, per_s = 0.3f / c.period_s, by_H_V = per_s * per_s * c.line_H / (2.0f * p.seen_A) * c.period_s;
  const float end_V = 2.5f * p.seen_A * c.line_ohm + 1.2f * c.diode_V, step_V = by_ohm_V > by_H_V ? by_ohm_V : by_H_V;
  p.drive_first = 0.3f * c.dead_counts;
  p.drive_step = clamp(step_V < end_V * (1.0f / 12) ? step_V * counts_V : end_V * (1.0f / 12) * counts_V, 0.5f, c.most_counts);
  p.drive_last = clamp(1.6f * c.dead_counts + end_V * counts_V, p.drive_first, c.most_counts);
  p.hold = static_cast<std::uint16_t>(clamp(3.0f + 2.5f * c.line_H / (c.line_ohm * c.period_s), 3.0f, 400.0f));
  s.findings = 0;
  s.broken = Broken::none;
  s.under_way = true;
  s.seen = 0;
  enter(s, SelfTestStage::lows);
}

constexpr void finish(SelfTestVariables& s, SelfTest result, SelfTestStep& out) {
  s.under_way = false;
  s.result = result;
  out = {0, {}, true};
}

constexpr void found(SelfTestVariables& s, Broken what, std::size_t leg, SelfTestStep& out) {
  out.gates = 0;
  const bool again = s.broken == what && s.leg == leg;
  s.broken = what;
  s.leg = static_cast<std::uint8_t>(leg);
  if (again || ++s.findings == kMostFindings) return finish(s, SelfTest::failed, out);
  s.seen = 0;
  enter(s, SelfTestStage::pause);
}

constexpr std::uint16_t whole(float counts) { return static_cast<std::uint16_t>(counts + 0.5f); }

// A train of pulses through `gates`: told in tick 0, on for `samples`, then off for `gap`; seen from the second sample on.
constexpr bool measuring(const SelfTestVariables& s, std::uint16_t samples) { return s.tick >= 2 && s.tick <= samples + 1; }
constexpr bool train(SelfTestVariables& s, std::uint8_t gates, std::uint16_t samples, std::uint16_t gap, SelfTestStep& out) {
  out.gates = s.tick >= 1 && s.tick <= samples ? gates : std::uint8_t{0};
  if (s.tick++ < samples + 1 + gap) return false;
  s.tick = 0;
  return true;
}
// Longer by one step, to `last` itself. False: that was the last.
constexpr bool widen(SelfTestVariables& s, float last) {
  if (s.width >= last) return false;
  s.width = s.width + s.plan.step < last ? s.width + s.plan.step : last;
  return true;
}

constexpr std::uint16_t low_samples(const SelfTestVariables& s) { return s.width >= s.plan.low_last ? s.plan.samples : std::uint16_t{1}; }

// The low side of leg A alone: only a shorted high side feeds it. What a turning rotor drives through the diodes sums to zero.
constexpr void lows(const SelfTestConfig& c, SelfTestVariables& s, const Phases& i_A, SelfTestStep& out) {
  const std::uint16_t samples = low_samples(s);
  for (std::uint16_t& x : out.compare.phase) x = whole(c.top - s.width);
  if (measuring(s, samples)) {
    const float sum_A = i_A[0] + i_A[1] + i_A[2], least_A = i_A[0] > sum_A ? i_A[0] : sum_A;
    if (least_A < -c.alone_A) return found(s, Broken::high_short, 0, out);
    // Not yet settled, an amplifier shows as little of a short circuit: one longer pulse tells.
    if (least_A < -s.plan.seen_A && (s.hits++ > 0 || s.width >= s.plan.low_last)) {
      const float width = s.width;
      enter(s, SelfTestStage::which_high);
      s.width = width;
      s.tick = static_cast<std::uint16_t>(samples + 2u);
      return;
    }
  }
  if (train(s, low_gate(0), samples, kGap, out) && !widen(s, s.plan.low_last)) enter(s, SelfTestStage::rotation);
}

// The high side of B or C, after a gap in which the current dies. Closing B's as well changes nothing if B's is the shorted one; otherwise
// C's current finds a second way.
constexpr void which_high(const SelfTestConfig& c, SelfTestVariables& s, const Phases& i_A, SelfTestStep& out) {
  const std::size_t leg = 1u + s.index % 2u;
  for (std::uint16_t& x : out.compare.phase) x = whole(c.top - s.width);
  out.compare.phase[leg] = whole(c.top);
  const std::uint16_t samples = low_samples(s);
  if (measuring(s, samples) && s.index > 0) s.sum[leg] -= i_A[0];
  if (!train(s, static_cast<std::uint8_t>(low_gate(0) | high_gate(leg)), samples, kLongGap, out)) return;
  // Long trains are clear enough, and would turn the rotor.
  const std::uint8_t comparisons = samples > 1 ? std::uint8_t{2} : std::uint8_t{8};
  if (++s.index > comparisons) found(s, Broken::high_short, s.sum[1] < s.sum[2] ? 1u : 2u, out);
}

// All low sides: a rotor that turns drives a current through the shorted windings. One that only swings is at rest soon.
constexpr void rotation(SelfTestVariables& s, const Phases& i_A, SelfTestStep& out) {
  constexpr std::uint8_t kLows = low_gate(0) | low_gate(1) | low_gate(2);
  out.gates = s.tick >= 1 ? kLows : std::uint8_t{0};
  if (s.tick++ < 2) return;
  bool large = false, turns = false;
  for (std::size_t k = 0; k < 3; ++k) {
    s.sum[k] += i_A[k];
    large |= magnitude(i_A[k]) > 2.0f * s.plan.seen_A;
    turns |= magnitude(s.sum[k]) > 0.35f * static_cast<float>(kBlock) * s.plan.seen_A;
  }
  s.hits = large ? static_cast<std::uint8_t>(s.hits + 1) : std::uint8_t{0};
  if (s.hits >= 2) return finish(s, SelfTest::turning, out);
  if (++s.index < kBlock) return;
  s.index = 0;
  s.sum = {};
  s.quiet = turns ? std::uint8_t{0} : static_cast<std::uint8_t>(s.quiet + 1);
  if (s.quiet < kQuietBlocks && s.tick > kBlock * kBlocks) return finish(s, SelfTest::turning, out);
  if (s.quiet < kQuietBlocks) return;
  out.gates = 0;
  enter(s, SelfTestStage::highs);
  s.index = s.broken == Broken::low_short && s.leg == 0 ? std::uint8_t{1} : std::uint8_t{0};
}

// Leg A alone and leg B alone: only a shorted low side of another leg closes the circuit, and its own shunt says which. Both take turns, B
// with pulses so much shorter that A's would have shown B's low side short before B's own could feel it.
// What is looked for a second time is looked for with the leg that found it, through all its pulses: the other may be shorting the supply.
constexpr void highs(SelfTestVariables& s, const Phases& i_A, SelfTestStep& out) {
  const SelfTestPlan& p = s.plan;
  const std::size_t leg = s.index;
  const bool in_turn = s.broken != Broken::low_short;
  const float behind = in_turn ? p.lag : 0.0f, wanted = leg == 1 ? s.width - behind : s.width;
  const float width = wanted < p.high_last ? wanted : p.high_last;
  const std::uint16_t samples = width >= p.high_last ? p.samples : std::uint16_t{1};
  out.compare.phase[leg] = width < p.high_first ? std::uint16_t{0} : whole(width);
  for (std::size_t k = 0; k < 3; ++k)
    if (measuring(s, samples) && k != leg && i_A[k] < -p.seen_A) return found(s, Broken::low_short, k, out);
  if (!train(s, static_cast<std::uint8_t>(high_gate(leg) | low_gate(leg)), samples, kGap, out)) return;
  if (in_turn) s.index ^= 1u;
  if ((in_turn && s.index != 0) || widen(s, p.high_last + behind)) return;
  const bool other = !in_turn && s.hits++ == 0;
  if (!other) return enter(s, SelfTestStage::directions);
  s.index ^= 1u;
  s.width = p.high_first;
}

constexpr std::size_t from_leg(std::size_t direction) { return direction / 2u; }
constexpr std::size_t to_leg(std::size_t direction) { return (direction / 2u + 1u + direction % 2u) % 3u; }

// Which directions had no current says what is open: those out of a high side, those into a low side, or all of a phase.
constexpr void judge(SelfTestVariables& s, SelfTestStep& out) {
  const unsigned missing = ~static_cast<unsigned>(s.seen) & 0x3Fu;
  if (missing == 0) {
    s.broken = Broken::none;
    return finish(s, SelfTest::passed, out);
  }
  for (std::size_t leg = 0; leg < 3; ++leg) {
    unsigned out_of = 0, into = 0;
    for (std::size_t d = 0; d < 6; ++d) out_of |= from_leg(d) == leg ? 1u << d : 0u, into |= to_leg(d) == leg ? 1u << d : 0u;
    if (missing == out_of) return found(s, Broken::high_open, leg, out);
    if (missing == into) return found(s, Broken::low_open, leg, out);
    if (missing == (out_of | into)) return found(s, Broken::phase_open, leg, out);
  }
  found(s, Broken::several, 0, out);
}

// From leg to leg, each pair both ways, by a duty that grows until the current is there or should long have been. The low side at the
// end of the way conducts all the time, so its shunt always shows the current.
constexpr void directions(SelfTestVariables& s, const Phases& i_A, SelfTestStep& out) {
  const std::size_t from = from_leg(s.index), to = to_leg(s.index);
  const bool ended = s.width >= s.plan.drive_last;
  out.compare.phase[from] = whole(s.width);
  out.gates = s.tick >= 1 ? static_cast<std::uint8_t>(high_gate(from) | low_gate(from) | low_gate(to)) : std::uint8_t{0};
  if (s.tick > 0) s.width = ended ? s.width : s.width + s.plan.drive_step;
  s.hits = s.tick >= 2 && -i_A[to] > s.plan.seen_A ? static_cast<std::uint8_t>(s.hits + 1) : std::uint8_t{0};
  // Ticks count the ramp up to its end, then the hold.
  s.tick = s.tick < 2 || ended ? static_cast<std::uint16_t>(s.tick + 1) : s.tick;
  const bool seen = s.hits >= 2;
  if (!seen && s.tick < 2 + s.plan.hold) return;
  if (seen) s.seen = static_cast<std::uint8_t>(s.seen | 1u << s.index);
  out.gates = 0;
  const std::uint8_t next = static_cast<std::uint8_t>(s.index + 1);
  if (next == 6) return judge(s, out);
  enter(s, SelfTestStage::directions);
  s.index = next;
}

}  // namespace self_test

// One sample; currents as the three shunts show them.
constexpr SelfTestStep step(const SelfTestConfig& c, SelfTestVariables& s, const Phases& i_A) {
  SelfTestStep out;
  switch (s.stage) {
    case SelfTestStage::lows:
      self_test::lows(c, s, i_A, out);
      break;
    case SelfTestStage::which_high:
      self_test::which_high(c, s, i_A, out);
      break;
    case SelfTestStage::rotation:
      self_test::rotation(s, i_A, out);
      break;
    case SelfTestStage::highs:
      self_test::highs(s, i_A, out);
      break;
    case SelfTestStage::directions:
      self_test::directions(s, i_A, out);
      break;
    case SelfTestStage::pause:
      if (++s.tick == self_test::kPause) self_test::enter(s, SelfTestStage::lows);
      break;
  }
  return out;
}

// Tuned on the simulated drive, 2026-11-26. Eight times a converter's noise of two counts for one sample; for two in a row half of that is
// enough.
constexpr float kTestWanted_counts = 16.0f, kTestWanted_A = 0.6f, kTestLeast_counts = 8.0f;
constexpr float kTestAlone = 0.5f;   // of the trip current
constexpr float kTestWait_s = 1.0f;  // from a rotor that turned to the next try

// possible: the parameters are ones that the board can serve.
template <Board B>
SelfTestConfig configure_self_test(const Parameters& p, const ModulatorConfig& modulator, bool possible, float tick_s) {
  const float A_per_count = magnitude(B::kCurrent_A_per_count), counts_s = modulator.top * static_cast<float>(B::kPwm_Hz);
  SelfTestConfig s;
  s.wanted = p.self_test && possible;
  s.top = modulator.top;
  s.period_s = sample_s<B>();
  s.counts_s = counts_s;
  s.pulses = static_cast<float>(B::kPwmPeriodsPerSample);
  s.dead_counts = modulator.dead_share * s.top;
  s.window_counts = 1e-9f * static_cast<float>(B::kSampleWindow_ns) * counts_s;
  s.most_counts = modulator.sample_duty * s.top;
  s.line_ohm = 2.0f * (p.resistance_ohm + B::kSwitchResistance_ohm);
  s.line_H = 2.0f * p.inductance_H;
  s.diode_V = B::kDiodeDrop_V;
  // Pulses lie in the middle of their periods, the sample at the end of the last; by then resistance has taken its share.
  const float half = 0.5f * s.line_ohm / (s.line_H * static_cast<float>(B::kPwm_Hz));
  s.left = B::kPwmPeriodsPerSample == 2 ? 0.5f * (exp_minus(half) + exp_minus(3.0f * half)) : exp_minus(half);
  s.wanted_A = kTestWanted_counts * A_per_count > kTestWanted_A ? kTestWanted_counts * A_per_count : kTestWanted_A;
  s.least_A = kTestLeast_counts * A_per_count;
  s.alone_A = kTestAlone * B::kTripCurrent_A;
  s.wait_ticks = ticks(kTestWait_s, tick_s);
  s.late_us = static_cast<std::uint32_t>(2.5e6f * s.period_s);
  return s;
}
}  // namespace rotorloop::firmware
