// Tracking error before and after, paired by seed: the same flight with the same noise, flown with two vehicle files.
#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "bench/hil/closed_loop/plan.hpp"
#include "bench/hil/flight/run_folder.hpp"

namespace rotorloop::closed_loop {

// 100 (1 - mean after / mean before), with a 95 % interval over the pairs. All not-a-number for fewer than two pairs.
struct PairedReduction {
  double percent = std::numeric_limits<double>::quiet_NaN(), low = percent, high = percent;
  std::size_t pairs = 0;
};
// Bootstrap over pairs with the expanded percentiles of Hesterberg (The American Statistician 69, 2015, section 5.3.2), and Student's
// interval of the linearised ratio: the wider of the two at each end, as the bootstrap alone covers 86 % with four pairs.
// Needs before > 0.
PairedReduction paired_reduction(std::span<const double> before, std::span<const double> after);

struct TrackedFlight {
  JudgedFlight plan;
  std::vector<std::uint64_t> seeds;                 // of the pairs: completed in every run
  std::vector<double> before, identified, after;    // mean error, cm; `identified` may be empty
  std::size_t lost = 0;                             // flights of `after` that did not end as they should
  PairedReduction reduction, reduction_identified;  // against before
  bool pass = false;
  std::string reason;  // in words
};

// `identified` may be null. A flight that was completed before and is lost after fails, whatever the rest says.
std::vector<TrackedFlight> compare_tracking(const std::vector<JudgedFlight>& plan, const hil::RunResult& before,
                                            const hil::RunResult* identified, const hil::RunResult& after);

}  // namespace rotorloop::closed_loop
