#include "bench/stand/run/sequence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "host/base/constants.hpp"
#include "host/base/error.hpp"
#include "host/base/random.hpp"

namespace rotorloop::stand_run {
namespace {

constexpr std::uint64_t kShuffleModule = 0x53485546;  // "SHUF"
constexpr int kAbabLevels = 3;

Segment zero(double s) { return {.motion = Motion::zero, .duration_s = s, .measured = true}; }
Segment hold(double omega, double s) { return {.motion = Motion::hold, .omega_rad_s = omega, .duration_s = s, .measured = true}; }

// Equal distances of ω², as thrust and torque go with it.
std::vector<double> levels(const SequenceOptions& o, int n) {
  std::vector<double> out;
  const double a = o.low_rad_s * o.low_rad_s, b = o.high_rad_s * o.high_rad_s;
  for (int i = 0; i < n; ++i) out.push_back(std::sqrt(a + (b - a) * (n > 1 ? static_cast<double>(i) / (n - 1) : 0.5)));
  return out;
}

void shuffle(std::vector<double>& v, std::uint64_t seed) {
  const RandomStream random(seed, kShuffleModule);
  for (std::size_t i = v.size(); i > 1; --i) std::swap(v[i - 1], v[static_cast<std::size_t>(random.bits(i) % i)]);
}

double middle(const SequenceOptions& o) { return 0.5 * (o.low_rad_s + o.high_rad_s); }

void add_staircase(std::vector<Segment>& s, const SequenceOptions& o, bool shuffled) {
  std::vector<double> up = levels(o, o.levels);
  std::vector<double> all = up;
  for (int i = o.levels - 2; i >= 0; --i) all.push_back(up[static_cast<std::size_t>(i)]);
  if (shuffled) shuffle(all, o.seed);
  // At idle the rotor's own torque is next to nothing: what is read there is the running offset (decision 0112).
  s.push_back(hold(o.idle_rad_s, o.idle_s));
  for (const double w : all) s.push_back(hold(w, o.hold_s));
  s.push_back(hold(o.idle_rad_s, o.idle_s));
}

void add_return_to_base(std::vector<Segment>& s, const SequenceOptions& o) {
  for (const double w : levels(o, o.levels)) {
    s.push_back(hold(o.idle_rad_s, o.hold_s));
    s.push_back(hold(w, o.hold_s));
  }
  s.push_back(hold(o.idle_rad_s, o.hold_s));
}

void add_steps(std::vector<Segment>& s, const SequenceOptions& o) {
  for (int i = 0; i < o.repeats.value_or(kStepPairs); ++i)
    for (const double sign : {-1.0, 1.0})
      s.push_back({.motion = Motion::step, .omega_rad_s = (1.0 + sign * o.step_share) * middle(o), .duration_s = o.step_s});
}

void add_ramp(std::vector<Segment>& s, const SequenceOptions& o) {
  s.push_back({.motion = Motion::ramp, .omega_rad_s = o.high_rad_s, .from_rad_s = o.low_rad_s, .duration_s = o.ramp_s});
  s.push_back({.motion = Motion::ramp, .omega_rad_s = o.low_rad_s, .from_rad_s = o.high_rad_s, .duration_s = o.ramp_s});
}

// A and B in turn, each with zeros of its own, at the same speeds: what drifts slowly falls out of the differences.
void add_abab(std::vector<Segment>& s, const SequenceOptions& o) {
  for (int i = 0; i < o.repeats.value_or(kAbabPairs); ++i)
    for (const char configuration : {'A', 'B'}) {
      std::vector<Segment> part{zero(o.zero_s)};
      for (const double w : levels(o, kAbabLevels)) part.push_back(hold(w, o.hold_s));
      part.push_back(zero(o.zero_s));
      for (Segment& p : part) {
        p.configuration = configuration;
        s.push_back(p);
      }
    }
}

// Pseudo-random binary sequence of the greatest length of nine bits (x⁹ + x⁵ + 1; Golomb, Shift Register Sequences, 1967): as much power at
// each frequency as any signal of two levels can have, and at most nine chips at one speed.
constexpr std::size_t kChips = 511;
constexpr std::array<bool, kChips> pseudo_random_chips() {
  std::array<bool, kChips> out{};
  unsigned state = 0x1ff;
  for (bool& chip : out) {
    chip = (state & 1u) != 0;
    state = (state >> 1) | (((state ^ (state >> 4)) & 1u) << 8);
  }
  return out;
}

void add(std::vector<Segment>& s, const std::string& name, const SequenceOptions& o) {
  if (name == "staircase" || name == "shuffled") return add_staircase(s, o, name == "shuffled");
  if (name == "return-to-base") return add_return_to_base(s, o);
  if (name == "ramp") return add_ramp(s, o);
  if (name == "step") return add_steps(s, o);
  if (name == "abab") return add_abab(s, o);
  if (name == "chirp")
    s.push_back({.motion = Motion::chirp,
                 .omega_rad_s = middle(o),
                 .duration_s = o.chirp_s,
                 .amplitude = o.chirp_share,
                 .low_Hz = o.chirp_low_Hz,
                 .high_Hz = o.chirp_high_Hz});
  else if (name == "prbs")
    s.push_back(
        {.motion = Motion::prbs, .omega_rad_s = middle(o), .duration_s = o.prbs_s, .amplitude = o.prbs_share, .chip_s = o.prbs_chip_s});
  else if (name == "endurance")
    for (double t = 0.0; t < o.endurance_s; t += 10.0) s.push_back(hold(middle(o), std::min(10.0, o.endurance_s - t)));
  else if (name == "replay")
    s.push_back(
        {.motion = Motion::replay, .omega_rad_s = o.replay.back().omega_rad_s, .duration_s = o.replay.back().t_s - o.replay.front().t_s});
}

void check(const std::string& name, const SequenceOptions& o) {
  const auto refuse = [](const char* option, const std::string& what, const std::string& remedy) {
    throw Error({option, what, "", remedy});
  };
  if (std::find(std::begin(kSequences), std::end(kSequences), name) == std::end(kSequences))
    refuse("--sequence", fmt::format("\"{}\" is no sequence", name), fmt::format("use: {}", fmt::join(kSequences, ", ")));
  if (name == "zero") return;
  if (!(o.low_rad_s > 0.0 && o.high_rad_s > o.low_rad_s))
    refuse("--rpm", fmt::format("{:.0f} to {:.0f} RPM is no range of speeds", kRpm_per_rad_s * o.low_rad_s, kRpm_per_rad_s * o.high_rad_s),
           "give LOW,HIGH in RPM: LOW above 0, HIGH above LOW");
  if (!(o.idle_rad_s > 0.0 && o.idle_rad_s < o.low_rad_s) && (name == "staircase" || name == "shuffled" || name == "return-to-base"))
    refuse("--idle",
           fmt::format("{:.0f} RPM is not between 0 and the lowest speed, {:.0f} RPM", kRpm_per_rad_s * o.idle_rad_s,
                       kRpm_per_rad_s * o.low_rad_s),
           "lower --idle, or raise the lowest speed (--rpm LOW,HIGH, in RPM)");
  if (o.levels < 3 || o.levels > 60) refuse("--levels", fmt::format("{} levels are out of range: 3 to 60", o.levels), "12 are usual");
  if (o.repeats && (*o.repeats < 1 || *o.repeats > 200))
    refuse("--repeats", fmt::format("{} repeats are out of range: 1 to 200", *o.repeats), "36 steps or 3 pairs of A and B are usual");
  if (name == "replay" && o.replay.size() < 2)
    refuse("--replay", "no speeds to replay", "give a CSV with t_s and omega_rad_s or rpm, or a flight log");
}

}  // namespace

Plan make_plan(const std::vector<std::string>& names, const SequenceOptions& o) {
  if (names.empty()) throw Error({"--sequence", "no sequence", "", fmt::format("use: {}", fmt::join(kSequences, ", "))});
  Plan plan;
  plan.names = names;
  plan.replay = o.replay;
  plan.segments.push_back(zero(o.zero_s));
  for (const std::string& n : names) {
    check(n, o);
    add(plan.segments, n, o);
    plan.segments.push_back(zero(o.zero_s));
  }
  return plan;
}

double Plan::highest_rad_s() const {
  double most = 0.0;
  for (const Segment& s : segments) {
    most = std::max({most, s.from_rad_s, s.omega_rad_s * (1.0 + s.amplitude)});
    if (s.motion == Motion::replay)
      for (const ReplayPoint& p : replay) most = std::max(most, p.omega_rad_s);
  }
  return most;
}

double Plan::typical_s(double settle_s) const {
  double sum = 0.0;
  for (const Segment& s : segments) sum += s.duration_s + (s.motion == Motion::hold || s.motion == Motion::zero ? settle_s : 0.0);
  return sum;
}

double wanted_rad_s(const Plan& plan, const Segment& s, double since_s) {
  switch (s.motion) {
    case Motion::zero:
      return 0.0;
    case Motion::hold:
    case Motion::step:
      return s.omega_rad_s;
    case Motion::ramp:
      return s.from_rad_s + (s.omega_rad_s - s.from_rad_s) * std::clamp(since_s / s.duration_s, 0.0, 1.0);
    case Motion::chirp: {
      const double phase = s.low_Hz * since_s + 0.5 * (s.high_Hz - s.low_Hz) / s.duration_s * since_s * since_s;
      return s.omega_rad_s * (1.0 + s.amplitude * std::sin(2.0 * std::numbers::pi * phase));
    }
    case Motion::prbs: {
      static constexpr auto kSequence = pseudo_random_chips();
      const auto chip = static_cast<std::size_t>(std::max(0.0, since_s) / s.chip_s) % kChips;
      return s.omega_rad_s * (1.0 + (kSequence[chip] ? s.amplitude : -s.amplitude));
    }
    case Motion::replay:
      break;
  }
  const double t = plan.replay.front().t_s + since_s;
  const auto after = std::upper_bound(plan.replay.begin(), plan.replay.end(), t, [](double v, const ReplayPoint& p) { return v < p.t_s; });
  if (after == plan.replay.begin()) return plan.replay.front().omega_rad_s;
  if (after == plan.replay.end()) return plan.replay.back().omega_rad_s;
  const auto before = after - 1;
  return before->omega_rad_s + (after->omega_rad_s - before->omega_rad_s) * (t - before->t_s) / (after->t_s - before->t_s);
}

std::string_view name(Motion m) {
  constexpr std::string_view kNames[] = {"zero", "hold", "step", "ramp", "chirp", "prbs", "replay"};
  return kNames[static_cast<std::size_t>(m)];
}

}  // namespace rotorloop::stand_run
