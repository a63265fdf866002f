// What registers mean when no manual says it reliably: raw words without load and with a known one, and every reading of them (place, type,
// word order) ranked by whether it changes with the load, lies still otherwise, and has a scale that somebody would choose.
#pragma once
#include <string>
#include <vector>

#include "bench/stand/instruments/word_codec.hpp"

namespace rotorloop::modbus {

struct ProbeReadings {
  std::uint16_t address = 0;                             // of the first word
  std::vector<std::vector<std::uint16_t>> zero, loaded;  // several reads each, all words each time
};

struct ProbeCandidate {
  std::uint16_t address = 0;
  WordType type = WordType::u16;
  WordOrder order = WordOrder::ABCD;
  double zero = 0.0, loaded = 0.0;  // mean raw values
  double noise = 0.0;               // greatest departure from its mean
  double scale = 0.0;               // known load over the change
  double round_scale = 0.0;         // the nearest 1, 2 or 5 times a power of ten, when within `tolerance`; else 0
  double score = 0.0;
};

// Best first; those that do not change, or change less than three times their noise, are left out. `load`: in the unit that is wanted.
// `tolerance`: of the known load and the cell, relative.
std::vector<ProbeCandidate> rank_candidates(const ProbeReadings& readings, double load, double tolerance = 0.01);

// [[channel]] of a profile for the candidate.
std::string channel_text(const ProbeCandidate& candidate, const std::string& name, const std::string& quantity, const std::string& unit,
                         int fc, const std::string& source);

}  // namespace rotorloop::modbus
