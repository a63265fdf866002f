// What an effect must surpass not to be taken for a placebo (placebos.hpp).
#pragma once
#include <cstddef>
#include <span>
#include <string>

namespace rotorloop::diagnose {

struct PlaceboLimit {
  double wald = 0.0;
  double level = 0.0;  // chance that one more placebo stays below it: of the k-th of n, k / (n + 1)
  std::size_t placebos = 0;
};
// The least of the ascending `statistics` whose level is `level` or more; where they are too few, the largest, with the level that it has.
PlaceboLimit placebo_limit(std::span<const double> statistics, double level);
// "100 placebos, 99.0 % of such columns below Wald F 12.3"
std::string words(const PlaceboLimit& limit);

}  // namespace rotorloop::diagnose
