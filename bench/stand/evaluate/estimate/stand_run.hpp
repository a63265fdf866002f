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

// What the ESC measured of its motor at rest before the run.
struct MeasuredWinding {
  double phase_ohm = 0.0, winding_ohm = 0.0;  // with the ESC's switches, and without
  double inductance_d_H = 0.0, inductance_q_H = 0.0;
  double u_resistance = 0.0, u_inductance = 0.0;  // relative
  double degC = kNotMeasured;
};

// What an axis of the stand was read by, and how sure its profile is: "manual" is copied from documents and was never seen on hardware.
struct Instrument {
  std::string axis, model, channel, evidence, source;
};

// What stands beside the samples.
struct RunFacts {
  std::string motor, propeller, mount;  // serial numbers or names; mount: counts remounts
  double diameter_m = kNotMeasured;
  double air_density_kg_m3 = kNotMeasured;
  int pole_pairs = 0;  // 0: not known
  bool simulated = false;
  std::string calibrated_on, calibration_expires;  // "2026-11-20"; empty: not said
  std::vector<Instrument> instruments;
  std::optional<MeasuredWinding> winding;
  bool duty_along = false;  // duty is of the voltage along the torque axis, not of its amplitude
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
