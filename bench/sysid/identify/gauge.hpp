// What flights leave open: the common part of a term's numbers where the model has it already (host/effects/rotor_groups.hpp). Where
// nothing is known of k_1 or c_q before the flights, the gauge keeps the sum of such numbers where it is, so that k_1 or c_q holds the
// common part and the term holds what one rotor has and the others lack. Where the file knows them, the flights determine the sum: held,
// the common part of one weak rotor would be left over, and named as another effect.
#pragma once
#include <span>
#include <string_view>
#include <vector>

#include "bench/sysid/estimate/estimator.hpp"

namespace rotorloop::identify {

// Parameters of each term whose sum is in question: those of which all are free and shared by the flights.
std::vector<std::vector<int>> rotor_groups(const host::TermList& terms, std::span<const estimate::FreeParameter> free);

// Whether one of `priors`, no guess, speaks of the number of the model that holds the common part of this term's numbers.
bool common_part_known(std::string_view term_id, std::span<const estimate::JointPrior> priors);

// The sum of a group as `at` has it: knowledge far surer than what flights determine of any of its numbers; with the common part `known`
// from elsewhere only what such a term may be worth at all.
estimate::JointPrior prior_of_sum(const std::vector<int>& group, const estimate::ModelValues& at, bool known);

}  // namespace rotorloop::identify
