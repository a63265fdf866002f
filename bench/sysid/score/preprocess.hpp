// What is done to a logged signal before a flight becomes a track of states: spikes bridged, low-pass without phase shift. Samples at
// equal distance. (Offsets between streams are for the checks and for the fit's delay parameters.)
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace rotorloop::score {

// Butterworth low-pass of even `order`, run forward and backward: no phase shift, amplitude 1/2 at `cutoff_Hz` (1/sqrt 2 for each
// pass), steeper than `order` beyond. The ends are continued by reflection through the end point, so a straight line passes
// unchanged in the interior. Throws Error (usage) when the cut-off is not below half the rate or the order is odd.
std::vector<double> zero_phase_low_pass(std::span<const double> x, double cutoff_Hz, double rate_Hz, int order = 4);

// Replaces what is not finite, exceeds `largest`, or jumps by more than `largest_jump` from the last good sample by a straight line
// between good neighbours. Returns how many were replaced. A jump that lasts longer than `longest` samples is taken for real.
std::size_t bridge_spikes(std::span<double> x, double largest, double largest_jump, std::size_t longest = 20);

}  // namespace rotorloop::score
