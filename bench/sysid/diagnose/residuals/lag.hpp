// Does the motion follow what the model says drives it, or lead it? For each axis the lag at which the model's wrench best explains
// the measured one, with a block-bootstrap interval. A load cannot act before its cause: a lag that is surely negative says that
// the model drives this axis with the wrong quantity (the reaction to rotor acceleration leads the drag of rotor speed), or that one
// stream's clock is off, which then shows on every axis alike.
#pragma once
#include <cstdint>
#include <span>

#include "bench/sysid/diagnose/residuals/samples.hpp"

namespace rotorloop::diagnose {

struct AxisLag {
  std::size_t axis = 0;
  bool known = false;                       // the model's wrench moves enough, and the interval is short of the range searched
  double lag_s = 0.0;                       // > 0: the measured wrench comes later than the model's
  double low_s = 0.0, high_s = 0.0;         // 95 %
  double share = 0.0, share_at_zero = 0.0;  // of the measured wrench's variance, best lag and none
  double slope = 0.0;                       // measured over model at the best lag
  std::vector<double> tried_s, shares;
};

enum class LagVerdict { none, leads, follows };
struct LagFinding {
  LagVerdict verdict = LagVerdict::none;
  std::vector<std::size_t> axes;
  double lag_s = 0.0;                // mean over those axes
  std::vector<std::string> effects;  // effects/catalogue.toml, the likeliest first
  std::string words;
};

struct LagResult {
  std::array<AxisLag, kAxes> axis;
  std::vector<LagFinding> findings;
};

struct LagOptions {
  double range_s = 0.2, block_s = 2.0;
  double detrend_s = 1.0;    // what moves slower than this is left out: trim and drag give no lag
  double least_s = 4e-3;     // smaller lags are no finding
  double least_gain = 0.01;  // of the share, by the lag
  int resamples = 500;
  std::uint64_t seed = 1;
};

// `model` and `missing` must have gone through the same smoother: measured = model + missing.
LagResult lag_analysis(const Samples& samples, const Axes& model, const Axes& missing, const LagOptions& options = {});

}  // namespace rotorloop::diagnose
