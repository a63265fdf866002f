// Everything that a finished fit's residuals say before any effect is named: where and when the wrench is missing, with what it moves,
// what could predict it, whether it leads its cause, whether its scatter or its level changes. For the fit of the vehicle file's model
// and again for the model with the effects that were added.
#pragma once
#include <string>
#include <vector>

#include "bench/sysid/diagnose/residuals/dependence.hpp"
#include "bench/sysid/diagnose/residuals/lag.hpp"
#include "bench/sysid/diagnose/residuals/residual_series.hpp"
#include "bench/sysid/diagnose/residuals/spectrum.hpp"
#include "bench/sysid/diagnose/residuals/steps_in_time.hpp"
#include "bench/sysid/diagnose/residuals/unexplained.hpp"
#include "bench/sysid/diagnose/residuals/variance_effects.hpp"

namespace rotorloop::diagnose {

struct ResidualFindings {
  ResidualSeries series;  // without what only the statistics needed (simulated, whitened, state)
  Spectra spectra;
  DependenceResult dependence;
  LagResult lag;
  UnexplainedResult unexplained;
  VarianceResult variance;
  StepsResult steps;
  std::vector<std::string> words;  // most important first
};

// Of force (N) or torque (N m) on this axis: what less than that is missing counts for nothing on this vehicle.
double size_that_matters(std::size_t axis, const estimate::ModelValues& vehicle, const Criteria& criteria);

struct ResidualOptions {
  std::uint64_t seed = 1;
  // The logs of the fit, in its order: with them gyro and accelerometer that the fit did not use are compared too.
  std::span<const identify::FlightToFit> logs;
  Criteria criteria = {};
};

ResidualFindings analyse_residuals(const identify::Identification& result, const ResidualOptions& options = {});

}  // namespace rotorloop::diagnose
