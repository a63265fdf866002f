// Flies one flight of a scenario from spin-up to the end of its trajectory: builds the loop, runs it, writes its logs, and
// gives back what it was judged by and what a report shows of it.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "bench/hil/flight/loop.hpp"
#include "bench/hil/flight/metrics.hpp"
#include "bench/hil/flight/run_folder.hpp"
#include "bench/hil/flight/scenario.hpp"
#include "host/base/real_time.hpp"
#include "host/control/gains_file.hpp"
#include "host/effects/vehicle_terms_file.hpp"
#include "sim/plant/assemble.hpp"

namespace rotorloop::hil {

// Everything that the flights of a scenario share, read and checked once.
struct Inputs {
  sim::PlantFile plant;
  sim::SharedRotors rotors;
  host::VehicleModel vehicle;
  host::FileTerms effects;  // of the vehicle file
  host::GainsFile gains;
  std::vector<host::Trajectory> trajectories;      // one per FlightPlan
  std::shared_ptr<const sim::EscProgram> program;  // of emulated ESCs; null: none
  std::vector<std::filesystem::path> files;        // all that was read, the scenario first
};
Inputs read_inputs(const Scenario& scenario);  // throws Error

struct FlightOutcome {
  FlightResult result;
  std::array<sim::BusStatistics, 2> bus;
  ModuleCost cost;
};

struct FlightRequest {
  std::size_t flight = 0;  // index into Scenario::flights
  Variant variant = Variant::pd_ff;
  std::uint64_t seed = 1;
  std::filesystem::path folder;  // for the logs; empty: no logs
  bool measure_cost = false;
  // Called at every control step whose truth the plant has stored, spin-up included.
  std::function<void(const host::FlightRecord&, const PlantTruth&)> observe = nullptr;
  // Paced flights wait on it, BusChoice::pace says how fast; null in lockstep.
  WaitClock* clock = nullptr;
  std::int64_t catch_up_ns = Deadlines::kCatchUp_ns;  // further behind than this ends the flight in the safe state
};

// `advanced` gets the virtual seconds flown, about ten times per second of flight. `stop`: ends at the next such point.
FlightOutcome fly(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request, RunFolder* folder,
                  const std::function<void(double)>& advanced, const std::atomic<bool>* stop);

// What the loop of this request is made of; also used by tests that replay a flight's frames.
LoopConfig loop_config(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request);
// Who flies, and from when: somebody else's controller may ask for time before the trajectory (`config` then starts later).
std::unique_ptr<host::FlightController> make_controller(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request,
                                                        const std::atomic<bool>* stop, LoopConfig& config);
// From power-on to the end of the log: wait for the start, trajectory, half a second more.
double flight_duration_s(const LoopConfig& config, const host::Trajectory& trajectory);
double flight_duration_s(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request);

}  // namespace rotorloop::hil
