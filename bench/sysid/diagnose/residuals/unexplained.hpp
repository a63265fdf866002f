// When no effect of the library explains what is left: how large it is, how much of it any smooth function of the motion could
// explain, and whether it comes in bursts. A residual that nothing predicts is noise of the flight (gusts, contacts): it belongs into
// the noise figures and uncertainties, not into the model.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "bench/sysid/diagnose/decision_rules.hpp"
#include "bench/sysid/diagnose/residuals/additive_fit.hpp"

namespace rotorloop::diagnose {

// A short stretch in which the residual is far above its usual size.
struct Burst {
  std::size_t flight = 0, axis = 0;
  double from_s = 0.0, to_s = 0.0;
  double mean = 0.0, peak = 0.0;                  // N, N m; signed
  double ratio = 0.0;                             // largest rms over the window, over the usual one of the axis
  std::optional<Eigen::Vector3d> place_W_m = {};  // mean, where the inputs tell
};

// none: no more than noise by the figures of the fit. systematic: inputs explain a good part. bursts: most of the power in short
// events. stochastic: real, and nothing predicts it.
enum class ResidualKind { none, systematic, bursts, stochastic };
std::string_view name(ResidualKind k);

struct AxisUnexplained {
  double rms = 0.0, rms_expected = 0.0;  // of the residual; of noise of the fitted figures
  AdditiveFit explainable;
  double explainable_by_chance = 0.0;  // largest share among simulated residuals
  double burst_share = 0.0;            // of the residual's power in bursts
  double burst_rms = 0.0;              // what bursts alone make of the rms
};
// The same of one flight alone, predicted from its other parts: what acts in one flight of many is a small part of all.
struct FlightUnexplained {
  std::size_t flight = 0;
  std::array<AxisUnexplained, kAxes> axis;
  std::array<ResidualKind, kAxes> kind{};
};

struct UnexplainedResult {
  std::array<AxisUnexplained, kAxes> axis;
  std::array<ResidualKind, kAxes> kind{};
  std::vector<FlightUnexplained> flights;  // of more than one
  std::vector<Burst> bursts;               // in order of time
  double burst_window_s = 0.0;
  std::array<double, kAxes> burst_limit{};  // ratio that simulated residuals pass by chance (Criteria::chance) in a whole set of flights
};

struct UnexplainedOptions {
  double burst_window_s = 0.2;
  AdditiveOptions fit;
  Criteria criteria = {};
};

UnexplainedResult unexplained(const Samples& samples, const Axes& residual, std::span<const Axes> expected, std::span<const Channel> inputs,
                              const UnexplainedOptions& options = {});

// Only the search for bursts; `limit` as above.
std::vector<Burst> bursts(const Samples& samples, const std::vector<double>& residual, std::size_t axis, double window_s, double limit);

}  // namespace rotorloop::diagnose
