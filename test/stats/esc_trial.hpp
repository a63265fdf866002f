// One trial of the ESC study: a drawn motor on a drawn board, flown by the native firmware.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "test/stats/esc_motor_classes.hpp"

namespace rotorloop::stats {

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

EscTrial run_esc_trial(const MotorClass& c, std::uint64_t seed, const EscTrialSettings& settings);

std::string esc_csv_header();
std::string esc_csv_line(const EscTrial& t);
// Lines that are whole; throws nothing: what does not parse is left out and flown again.
std::vector<EscTrial> read_esc_trials(const std::string& path);

}  // namespace rotorloop::stats
