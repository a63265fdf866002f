// A validation as people and programs read it: text for the terminal, one JSON document, one HTML page with plots.
#pragma once
#include <string>
#include <vector>

#include "bench/propeller/validation.hpp"

namespace rotorloop::propeller {

struct ValidationDocument {
  std::vector<PropellerResult> results;
  std::vector<ValidationLimit> limits;
  std::string version, command;  // of the program; as it was called
  double stall_drag = 0.0;
};

bool all_pass(const std::vector<ValidationLimit>& limits);

std::string validation_text(const ValidationDocument& document);
std::string validation_json(const ValidationDocument& document);
std::string validation_html(const ValidationDocument& document);

}  // namespace rotorloop::propeller
