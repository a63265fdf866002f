// Estimates of many simulated runs on a thrust stand against the truth: bias, root mean square error and coverage.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "sim/rotor/blade.hpp"
#include "test/support/simulated_stand.hpp"

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

// Sums over runs. A truth of 0 is none: that value is not judged.
class EnsembleScores {
 public:
  void add(const stand::StandEstimate& estimate, const test::StandTruth& truth);
  StandEnsemble result() const;

 private:
  struct Sums {
    double error = 0.0, squares = 0.0, inside = 0.0, u = 0.0, n = 0.0;
    void add(double relative, bool in, double relative_u) {
      error += relative;
      squares += relative * relative;
      inside += in;
      u += relative_u;
      n += 1.0;
    }
  };
  struct Value {
    const char* name;
    double tolerance;
    Sums sums = {};
  };
  Sums c_t_, c_q_;
  std::vector<Value> values_{{"K_v", 0.01}, {"R", 0.05}, {"J", 0.03}, {"time constant, up", 0.05}, {"time constant, down", 0.05}};
};

// Another propeller of the same diameter: with its chord and twist the law of c_q over speed is another too.
sim::Blade drawn_blade(const sim::Blade& blade, std::uint64_t seed);

// Runs of seeds first, first + 1, …; `scratch` is a folder for their files. `drawn`: each run has a blade of its own, and the truth of that
// blade.
StandEnsemble stand_ensemble(const sim::Blade& blade, const std::filesystem::path& scratch, std::uint64_t first, std::size_t runs,
                             int draws, bool drawn = false);

}  // namespace rotorloop::stats
