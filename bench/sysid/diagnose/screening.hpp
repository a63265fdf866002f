// From a fit to the table of scores: one sweep of the elimination with a column for each parameter of the candidates.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "bench/sysid/diagnose/candidate.hpp"
#include "bench/sysid/diagnose/score_table.hpp"
#include "bench/sysid/identify/identify.hpp"

namespace rotorloop::diagnose {

struct Screening {
  ScoreTable table;
  std::vector<Candidate> candidates;
  std::vector<estimate::ExtraColumns> series;  // of each flight: columns of the terms, in the order of the candidates
};

// The linearisation stands at the fit. `stop` asked: throws estimate::FitStopped, as does table_with(). `without`: ids that are not
// considered; `library`: terms beside those of host/effects.
Screening screen(const identify::Identification& result, const std::vector<std::string>& without,
                 std::span<const host::Term* const> library, double block_s, int threads, estimate::StopFit stop = {});

// The scores of a fit by themselves, without candidates.
ScoreTable table_of(const identify::Identification& fit);
// … and with columns beside the model's own, of each flight. `held`: core parameters that the fit holds; their columns stand before these.
ScoreTable table_with(const identify::Identification& fit, const std::vector<estimate::ExtraColumns>& columns, double block_s, int threads,
                      estimate::StopFit stop = {}, const std::vector<int>& held = {});

}  // namespace rotorloop::diagnose
