// The level of false alarms as these very flights have it: columns that are no effect, tested like effects.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "bench/sysid/diagnose/placebo_limit.hpp"
#include "bench/sysid/diagnose/screening.hpp"

namespace rotorloop::diagnose {

// Copies of the columns of `real` (of each flight) without their mean, phases drawn anew (same spectrum, same relation between axes) or
// moved in time by more than two seconds. A column of which hardly anything is left without its mean gives none: a constant is an effect
// whatever is done to its phases, and so is what rounding leaves of it. None at all where no column is left.
std::vector<estimate::ExtraColumns> placebo_columns(std::span<const estimate::ExtraColumns> real, const std::vector<double>& step_s,
                                                    std::size_t count, std::uint64_t seed);

// Robust statistic of each through the sweep that tests the candidates, ascending.
std::vector<double> placebo_statistics(const identify::Identification& result, const Screening& screening, std::size_t count,
                                       std::uint64_t seed, double block_s, int threads, estimate::StopFit stop = {});

}  // namespace rotorloop::diagnose
