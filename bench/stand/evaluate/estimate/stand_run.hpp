// A run on a thrust stand as the estimator takes it: one row for each steady step, per rotor and in SI units, and the samples between
// steps where the file has them. Whoever wrote the file: a run folder, an RCbenchmark (Tyto) export, or any CSV through a mapping.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "bench/stand/evaluate/estimate/stand_uncertainty.hpp"
#include "bench/stand/evaluate/stand_checks.hpp"
#include "bench/stand/evaluate/stand_file.hpp"

namespace rotorloop::stand {

struct StandStep {
  double t_s = kNotMeasured;
  double omega_rad_s = 0.0;                                       // 0: a zero, the rotor at rest
  double thrust_N = kNotMeasured, torque_N_m = kNotMeasured;      // of one rotor
  double thrust_u_N = kNotMeasured, torque_u_N_m = kNotMeasured;  // of the mean, from the samples' scatter
  double voltage_V = kNotMeasured, current_A = kNotMeasured, duty = kNotMeasured, winding_degC = kNotMeasured;
  double airspeed_m_s = kNotMeasured;
  int direction = 0;  // the speed came from below (+1) or from above (-1): friction in the mount turns with it
  int block = 0;      // neighbours of one block err together; a bootstrap draws blocks
};

struct SampleSeries {  // of one rotor, all of one length; empty where the file has steps only
  std::vector<double> t_s, omega_rad_s, target_rad_s, thrust_N, torque_N_m;
  bool empty() const { return t_s.empty(); }
};

struct StandRun {
  std::string name;
  RunFacts facts;
  StandUncertainty known;
  CheckedStand checked;          // faults of the channels; a faulty one has no coefficient
  std::vector<StandStep> steps;  // in the order of time, zeros among them
  SampleSeries samples;
  std::vector<std::string> remarks;
};

struct RunOptions {
  std::optional<StandMapping> mapping;  // without: a run folder, or a CSV that is recognised by its header
  std::optional<double> diameter_m, air_density_kg_m3;
  std::optional<StandUncertainty> known;  // else the run's own, else typical values
};

// `path`: a run folder (samples.csv, run.toml) or a CSV. Throws Error: usage for a header that nobody knows, data_quality for a damaged
// file.
StandRun read_stand_run(const std::filesystem::path& path, const RunOptions& options);

// The same of points that were read already.
StandRun stand_run(StandRecord record, const RunOptions& options);

}  // namespace rotorloop::stand
