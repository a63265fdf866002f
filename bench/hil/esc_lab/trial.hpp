// One trial: a drawn motor on a drawn board, flown by the native firmware.
#pragma once
#include <cstdint>
#include <string>

#include "bench/hil/esc_lab/esc_trace.hpp"
#include "bench/hil/esc_lab/motor_classes.hpp"

namespace rotorloop::esc_lab {

enum class EscExperiment : std::uint8_t { fly, step, catch_rotor };

struct EscTrialSettings {
  EscExperiment experiment = EscExperiment::fly;
  Knowledge knowledge = Knowledge::data_sheet;
  bool ideal_board = false;  // gains and offsets alone are drawn, as before boards were
};

// All figures are the plant's true ones. Not every field belongs to every experiment.
struct EscTrial {
  std::uint64_t seed = 0;
  std::string motor_class;
  double start_within_ms = 0.0;         // its limit
  double bus_V = 0.0, top_rad_s = 0.0;  // highest speed that the draw holds
  double start_ms = 1e9;                // to 98 % of 2 000 RPM or of 20 % of the top, whichever is less; 1e9: never
  double start_peak_A = 0.0, peak_A = 0.0;
  int start_trips = 0, trips = 0;  // until started; afterwards
  std::string causes;              // of all trips, by number of the fault
  double longest_gap_ms = 0.0;     // without speed control, afterwards
  bool latched = false;            // not turning at the end
  // step: 40 to 60 % of the top; over the best that the limits allow.
  double rise_ratio = 0.0, settle_ratio = 0.0, rise_ms = 0.0, settle_ms = 0.0, overshoot_percent = 0.0, steady_percent = 0.0;
  // catch: from `caught_from` of the top to 60 % of it.
  double caught_from = 0.0, caught_ms = 0.0;
};

// `trace`: what happened from power-up, when given.
EscTrial run_esc_trial(const EscDraw& draw, const EscTrialSettings& settings, EscTrace* trace = nullptr);
EscTrial run_esc_trial(const MotorClass& c, std::uint64_t seed, const EscTrialSettings& settings);

// Limits of docs/acceptance/esc_any_motor.md. Ratios: over the best that current and voltage allow.
inline constexpr double kMostRise = 1.3, kMostSettle = 2.0, kMostOvershoot_percent = 5.0, kMostSteady_percent = 0.2;
inline constexpr double kLongestGap_ms = 100.0, kLeastCleanShare = 294.0 / 300.0;
inline constexpr double kLeastBandwidth_Hz = 20.0, kMostSag_percent = 0.7;  // docs/acceptance/esc_rpm_loop.md
inline bool started_in_time(const EscTrial& t) { return t.start_ms <= t.start_within_ms; }
bool step_within(const EscTrial& t);
double catch_limit_ms(const EscTrial& t);
inline bool caught_in_time(const EscTrial& t) { return t.trips == 0 && t.caught_ms <= catch_limit_ms(t); }

}  // namespace rotorloop::esc_lab
