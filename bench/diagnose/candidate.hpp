// An effect that may be missing, with the parameters that would be estimated for it.
#pragma once
#include <string>
#include <vector>

#include "bench/diagnose/score_table.hpp"
#include "host/effects/term.hpp"

namespace rotorloop::diagnose {

struct CandidateParameter {
  std::string name, unit;
  double neutral = 0.0, min = 0.0, max = 0.0;
  double scale = 1.0;  // a change that matters
};

struct Candidate {
  std::string id;                    // effects/catalogue.toml
  const host::Term* term = nullptr;  // or, for quantities of the fit itself:
  std::vector<int> core = {};        // enum Parameter
  std::vector<CandidateParameter> parameters = {};
  ColumnSet columns = {};  // of the table
};

}  // namespace rotorloop::diagnose
