// An effect that may be missing, with the parameters that would be estimated for it: a term that the model lacks, or a quantity that the
// fit holds or of which the vehicle file has a prior (gravity's direction, delays, products of inertia).
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/score_table.hpp"
#include "bench/sysid/identify/identify.hpp"
#include "host/effects/term.hpp"
#include "host/vehicle/effect_catalogue.hpp"

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

// Whether it changes force and torque (by the rotor speeds they are reckoned from, too), not only what poses and inertial sensors read.
bool acts_on_body(const Candidate& candidate);

// Every row of the catalogue that a term or a quantity of the fit holds and this model does not, and the terms of `library`. `without`:
// ids that are not considered. Throws Error where row and code do not fit together.
std::vector<Candidate> candidates_for(const identify::Identification& model, const std::vector<std::string>& without,
                                      std::span<const host::Term* const> library);

// Of kind `parameter`, by the first quantity of the fit that it is: estimate::kPoseDelay.
const host::CatalogueEffect& effect_of_parameter(int core_parameter);

}  // namespace rotorloop::diagnose
