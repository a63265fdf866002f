// What is done to a logged signal before flights are compared or predicted: spikes bridged, low-pass without phase shift, one grid,
// the lag between two signals. Works on samples at equal distance unless it says otherwise.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "bench/identify/flight_record.hpp"

namespace rotorloop::bench {

// Butterworth low-pass of even `order`, run forward and backward: no phase shift, amplitude 1/2 at `cutoff_Hz` (1/sqrt 2 for each
// pass), steeper than `order` beyond. The ends are continued by reflection through the end point, so a straight line passes
// unchanged in the interior. Throws Error (usage) when the cut-off is not below half the rate or the order is odd.
std::vector<double> zero_phase_low_pass(std::span<const double> x, double cutoff_Hz, double rate_Hz, int order = 4);

// Replaces what is not finite, exceeds `largest`, or jumps by more than `largest_jump` from the last good sample by a straight line
// between good neighbours. Returns how many were replaced. A jump that lasts longer than `longest` samples is taken for real.
std::size_t bridge_spikes(std::span<double> x, double largest, double largest_jump, std::size_t longest = 20);

// Values of a stream of scalars at start + k step, linear between samples, held outside; k = 0 … count - 1.
std::vector<double> on_grid(std::span<const double> t_s, std::span<const double> value, double start_s, double step_s, std::size_t count);

// By how much `late` is behind `early`: the lag at the peak of their correlation (means removed), refined by a parabola through the
// peak and its neighbours. Positive when `late` shows the same event later.
struct Lag {
  double lag_s = 0.0;
  double correlation = 0.0;  // at the peak, 1 for the same shape
};
Lag lag_between(std::span<const double> early, std::span<const double> late, double rate_Hz, double largest_lag_s);

}  // namespace rotorloop::bench
