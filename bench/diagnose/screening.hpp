// From a fit to the table of scores: which effects are candidates, and one sweep of the elimination with a column for each of their
// parameters. A candidate is a term that the model lacks, or a quantity that the fit holds or that the vehicle file believed to know
// (gravity's direction, delays, products of inertia).
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/diagnose/candidate.hpp"
#include "bench/diagnose/score_table.hpp"
#include "bench/identify/identify.hpp"

namespace rotorloop::diagnose {

// Whether it changes force and torque (by the rotor speeds they are reckoned from, too), not only what poses and inertial sensors read.
bool acts_on_body(const Candidate& candidate);

struct Screening {
  ScoreTable table;
  std::vector<Candidate> candidates;
  std::vector<estimate::ExtraColumns> series;  // of each flight: columns of the terms, in the order of the candidates
};

// The linearisation stands at the fit. `without`: ids that are not considered; `library`: terms beside those of host/effects.
Screening screen(const identify::Identification& result, const std::vector<std::string>& without, std::span<const host::Term* const> library,
                 double block_s, int threads);

// The scores of a fit by themselves, without candidates.
ScoreTable table_of(const identify::Identification& fit);
// … and with columns beside the model's own, of each flight.
ScoreTable table_with(const identify::Identification& fit, const std::vector<estimate::ExtraColumns>& columns, double block_s, int threads);

}  // namespace rotorloop::diagnose
