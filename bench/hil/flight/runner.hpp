// The one function behind `rotorloop hil`: flies every flight x variant x seed of a scenario and leaves a run folder.
#pragma once
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/hil/flight/metrics.hpp"
#include "bench/hil/flight/run_folder.hpp"
#include "bench/hil/flight/scenario.hpp"

namespace rotorloop::hil {

struct RunOptions {
  std::filesystem::path runs_dir = "runs";  // the run folder is runs_dir / name
  std::string name;                         // empty: made from the scenario's name
  bool force = false;                       // replace an existing run folder
  bool logs = true;                         // false: figures alone are kept, no log of any flight
  int jobs = 1;                             // flights at a time; results do not depend on it; a paced scenario is flown one at a time
  std::int64_t catch_up_ns = Deadlines::kCatchUp_ns;  // of a paced scenario: further behind than this disarms the motors and ends the run
  std::string command_line;                           // for run.toml
  const std::atomic<bool>* stop = nullptr;            // set by Ctrl-C: end the flights at the next step, write what there is
};

struct FlightKey {
  std::string flight;
  Variant variant = Variant::pd_ff;
  std::uint64_t seed = 0;
};

// Gets the runner's progress; may be called from several threads at once.
class Progress {
 public:
  virtual ~Progress() = default;
  virtual void begin(std::size_t flights, double virtual_s_total) = 0;
  virtual void advance(double virtual_s) = 0;  // virtual time flown since the last call, any flight
  virtual void finished(const FlightResult& flight) = 0;
  virtual void warn(const std::string& where, const std::string& what) = 0;
  virtual void end() = 0;
};

struct HilResult {
  RunResult result;              // what result.json holds
  std::filesystem::path folder;  // of the run
  std::vector<FlightResult> flights;
  Assessment assessment;
};

// `scenario` as read, with seeds and variants already narrowed by the caller. Throws Error while setting up (input files,
// run folder); a flight that crashes is a result, not an error. Deterministic: the same scenario and version give the same logs to the
// bit. To change plant, vehicle or gains in a program, fly one flight at a time (flight.hpp).
HilResult run_hil(const Scenario& scenario, const RunOptions& options, Progress& progress);

}  // namespace rotorloop::hil
