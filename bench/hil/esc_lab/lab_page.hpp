// The laboratory's result as a page, as lines for a terminal, and as JSON.
#pragma once
#include <string>

#include "bench/hil/esc_lab/lab.hpp"

namespace rotorloop::esc_lab {

std::string lab_text(const LabResult& result);
// One self-contained HTML file.
std::string lab_html(const LabResult& result, const std::string& version);
// Format 1: verdict, errors, name, seed, draws, schedules, rows of {battery, what, value, unit, limit, at_least, met, note}.
std::string lab_json(const LabResult& result, const std::string& version);

}  // namespace rotorloop::esc_lab
