// Trials of the ESC study as lines of a file, so that an interrupted study goes on where it stopped.
#pragma once
#include <string>
#include <vector>

#include "bench/hil/esc_lab/trial.hpp"

namespace rotorloop::stats {

std::string esc_csv_header();
std::string esc_csv_line(const esc_lab::EscTrial& t);
// Lines that are whole; throws nothing: what does not parse is left out and flown again.
std::vector<esc_lab::EscTrial> read_esc_trials(const std::string& path);

}  // namespace rotorloop::stats
