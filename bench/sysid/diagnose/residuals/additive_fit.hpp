// How much of a residual any smooth sum of functions of the inputs could explain: penalised cubic B-splines (Eilers and Marx 1996),
// the penalty chosen and the share scored on blocks or flights that did not make the fit. No physics: the ceiling that effects of a
// library can reach, and the shape of what is left when none does.
#pragma once
#include <span>

#include "bench/sysid/diagnose/residuals/samples.hpp"

namespace rotorloop::diagnose {

struct AdditiveOptions {
  std::size_t intervals = 8;  // of each input's range, 1st to 99th percentile; beyond, the function holds its end value; products: a line
  double block_s = 1.5;
  int folds = 6;
  LeftOut left_out = LeftOut::flights;
  std::vector<double> penalties{1e-3, 1e-2, 1e-1, 1.0, 10.0};  // relative to the mean information of a coefficient
};

// One input's part of the sum, as a curve.
struct PartialCurve {
  std::size_t input = 0;
  std::vector<double> at, value, u;  // u: jackknife over folds
  double share = 0.0;                // mean square of the curve over that of the residual
  double alone = 0.0;                // held-out share that is lost without this input
};
struct AdditiveFit {
  double share = 0.0;  // of the residual's power predicted where it was not fitted, 0 … 1; below 0: nothing was learnt
  double penalty = 0.0;
  std::vector<PartialCurve> curves;  // largest share first
};

// One fit for each residual; all share the inputs. Inputs that do not vary are left out. `curves`: how many of the residuals, from the
// first, get curves (they cost a fit for each input).
std::vector<AdditiveFit> additive_fit(const Samples& samples, std::span<const std::vector<double>* const> residuals,
                                      std::span<const Channel> inputs, std::size_t curves, const AdditiveOptions& options = {});

}  // namespace rotorloop::diagnose
