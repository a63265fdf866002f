// What is unobservable in any flight: the common part of a term's numbers where the model has it already (host/effects/rotor_groups.hpp). The gauge keeps
// the sum of such numbers where it is, so that k_1 or c_q holds the common part and the term holds what one rotor has and the others lack.
#pragma once
#include <span>
#include <vector>

#include "bench/estimate/estimator.hpp"

namespace rotorloop::identify {

// Parameters of each term whose sum is in question: those of which all are free and shared by the flights.
std::vector<std::vector<int>> rotor_groups(const host::TermList& terms, std::span<const estimate::FreeParameter> free);

// The sum of a group as `at` has it, as knowledge that is far surer than what flights determine of any of its numbers.
estimate::JointPrior sum_held(const std::vector<int>& group, const estimate::ModelValues& at);

}  // namespace rotorloop::identify
