// A section as XFOIL takes it: NACA digits, or the coordinates of a .dat file.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/propeller/text_file.hpp"

namespace rotorloop::propeller {

struct SectionShape {
  std::string label;         // "NACA 4412", or the first line of the file
  std::string naca;          // digits; empty: coordinates
  std::vector<double> x, y;  // of the chord, from the trailing edge over the upper side to the leading edge and back below
  double thickness_percent = 0.0, camber_percent = 0.0;  // of the chord
};

// The digits of "NACA 4412", "naca4412" or "4412", four or five of them; nothing for any other text. Throws Error for digits that name no
// section of these families.
std::optional<std::string> naca_digits(const std::string& text);
SectionShape naca_section(const std::string& digits);

// Selig (one loop from the trailing edge) or Lednicer (counts, upper side, lower side), moved and scaled to a chord of 1. Throws Error
// (usage) with line and value.
SectionShape read_section_file(const TextFile& file);

}  // namespace rotorloop::propeller
