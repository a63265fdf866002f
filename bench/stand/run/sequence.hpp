// What a run on a stand turns through: segments of rotor speed over time, by the name of a sequence (docs/manual.md, "Runs on a stand").
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace rotorloop::stand_run {

enum class Motion : std::uint8_t { zero, hold, step, ramp, chirp, prbs, replay };

struct Segment {
  Motion motion = Motion::hold;
  double omega_rad_s = 0.0;            // at its end; chirp, prbs: the middle
  double from_rad_s = 0.0;             // ramp: at its beginning
  double duration_s = 0.0;             // hold: of what is averaged, after settling
  double amplitude = 0.0;              // chirp, prbs: share of the middle
  double low_Hz = 0.0, high_Hz = 0.0;  // chirp
  double chip_s = 0.0;                 // prbs: the shortest time at one speed
  bool measured = false;               // its samples after settling are one step of the estimate
  char configuration = 'A';            // abab: A bare, B with what is put behind the rotor
};

struct ReplayPoint {
  double t_s = 0.0, omega_rad_s = 0.0;
};

// Speeds in rad/s, times in seconds. `low` to `high` is where coefficients are wanted.
struct SequenceOptions {
  double low_rad_s = 300.0, high_rad_s = 1000.0, idle_rad_s = 150.0;
  int levels = 12;
  double hold_s = 1.5, zero_s = 6.0, idle_s = 8.0;
  double step_share = 0.07;  // step: about the middle, up and down
  // Pairs of steps, or of A and B at each speed; none: kStepPairs, kAbabPairs.
  std::optional<int> repeats;
  double step_s = 0.7;
  double chirp_share = 0.03, chirp_low_Hz = 0.5, chirp_high_Hz = 12.0, chirp_s = 40.0;
  // Both steps together stay below what an estimate takes for a step of its own (3 %). Three periods of 511 chips; flat within 3 dB to 15
  // Hz.
  double prbs_share = 0.014, prbs_chip_s = 0.03, prbs_s = 3 * 511 * 0.03;
  double ramp_s = 30.0, endurance_s = 300.0;
  std::uint64_t seed = 1;  // shuffled
  std::vector<ReplayPoint> replay;
};

struct Plan {
  std::vector<std::string> names;
  std::vector<Segment> segments;
  std::vector<ReplayPoint> replay;
  double highest_rad_s() const;
  double typical_s(double settle_s) const;  // holds settle in `settle_s`
};

// 36 pairs of steps tell J to 1.5 %, 12 to 1.8 % (docs/acceptance/thrust_stand.md).
inline constexpr int kStepPairs = 36, kAbabPairs = 12;

inline constexpr std::string_view kSequences[] = {"zero",  "staircase", "shuffled",  "return-to-base", "ramp", "step",
                                                  "chirp", "prbs",      "endurance", "replay",         "abab"};

// Sequences one after the other, zeros before, between and after. Throws Error (usage) for an unknown name, and for speeds and counts that
// make no run.
Plan make_plan(const std::vector<std::string>& names, const SequenceOptions& options);

// Wanted speed `since_s` after the segment began (a hold's: from its first moment).
double wanted_rad_s(const Plan& plan, const Segment& segment, double since_s);

std::string_view name(Motion motion);

}  // namespace rotorloop::stand_run
