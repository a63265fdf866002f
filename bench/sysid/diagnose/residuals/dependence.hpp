// What the residual wrench depends on, one input at a time: means over bins of the input with block-bootstrap bands, and a ranking of
// inputs by the share of the residual's power that those means predict in blocks that did not make them.
#pragma once
#include <cstdint>
#include <span>

#include "bench/sysid/diagnose/residuals/samples.hpp"

namespace rotorloop::diagnose {

struct DependenceBin {
  double from = 0.0, to = 0.0, centre = 0.0;  // of the input; centre: mean of its samples
  std::size_t samples = 0;
  double mean = 0.0, low = 0.0, high = 0.0;  // of the residual; 95 % band
};
struct Dependence {
  std::size_t input = 0, axis = 0;
  double share = 0.0;   // of the residual's power that the bins' means predict elsewhere; can be negative: worse than zero
  double chance = 0.0;  // largest such share of any input on this axis when the residual is noise of the fitted figures
  std::vector<DependenceBin> bins;
};

// Mean residual by place, seen from above.
struct PlaceMap {
  std::size_t axis = 0, columns = 0, rows = 0;
  double x_from_m = 0.0, y_from_m = 0.0, cell_m = 0.0;
  std::vector<double> mean, u;  // row by row from the lowest y; not-a-number where no block has been
};

struct DependenceResult {
  std::vector<Dependence> ranking;  // all pairs, largest share first; bins of those with `with_bins` rank or better on their axis
  std::vector<PlaceMap> maps;       // force z and the largest other axis, when flights cover more than three cells each way
};

struct DependenceOptions {
  std::size_t bins = 10;  // equally filled
  double block_s = 1.5;
  int folds = 6, resamples = 300;
  std::size_t with_bins = 4;
  std::uint64_t seed = 1;
};

DependenceResult dependence(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                            const DependenceOptions& options = {});

}  // namespace rotorloop::diagnose
