// Estimates of many simulated runs on a thrust stand against the truth: bias, root mean square error and coverage.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sim/rotor/blade.hpp"

namespace rotorloop::stats {

struct CoefficientScore {
  std::string name;
  double bias = 0.0, rmse = 0.0;  // relative
  double covered = 0.0;           // share of the 95 % intervals that hold the truth
  double mean_u = 0.0;            // relative
};

struct ValueScore {
  std::string name;
  double within = 0.0;  // share of the runs within `tolerance`
  double tolerance = 0.0, rmse = 0.0;
};

struct StandEnsemble {
  std::vector<CoefficientScore> coefficients;  // c_t, c_q
  std::vector<ValueScore> values;              // K_v, R, J, time constants
  std::size_t runs = 0;
};

// Runs of seeds first, first + 1, …; `scratch` is a folder for their files.
StandEnsemble stand_ensemble(const sim::Blade& blade, const std::filesystem::path& scratch, std::uint64_t first, std::size_t runs, int draws);

}  // namespace rotorloop::stats
