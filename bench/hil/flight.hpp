// Flies one flight of a scenario from spin-up to the end of its trajectory: builds the loop, runs it, writes its logs, and
// gives back what it was judged by and what a report shows of it.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "bench/hil/loop.hpp"
#include "bench/hil/metrics.hpp"
#include "bench/hil/plant_setup.hpp"
#include "bench/hil/run_folder.hpp"
#include "bench/hil/scenario.hpp"
#include "host/control/gains_file.hpp"

namespace rotorloop::bench {

// Everything that the flights of a scenario share, read and checked once.
struct Inputs {
  sim::PlantFile plant;
  SharedRotors rotors;
  host::VehicleModel vehicle;
  host::GainsFile gains;
  std::vector<host::Trajectory> trajectories;      // one per FlightPlan
  std::vector<std::filesystem::path> files;        // all that was read, the scenario first
};
Inputs read_inputs(const Scenario& scenario);      // throws Error

// Series for the report, thinned to one sample every kTraceStep control steps.
struct FlightTrace {
  static constexpr int kTraceStep = 5;             // 200 Hz
  std::vector<float> t_s;
  std::vector<std::array<float, 3>> p_m, sp_p_m, est_p_m, v_m_s;
  std::vector<float> error_m, error_z_m, estimator_error_m;
  std::vector<std::array<float, 4>> omega_rad_s, omega_cmd_rad_s, i_q_A;
  std::vector<std::array<std::uint8_t, 4>> esc_limiter;
  std::vector<std::uint8_t> control_limiter;
  std::vector<float> bus_V;
};

struct FlightOutcome {
  FlightResult result;
  FlightTrace trace;
  std::array<std::vector<float>, 2> bus_load_percent;  // per 10 ms window, by BusName
  std::array<sim::BusStatistics, 2> bus;
  ModuleCost cost;
};

struct FlightRequest {
  std::size_t flight = 0;  // index into Scenario::flights
  Variant variant = Variant::pd_ff;
  std::uint64_t seed = 1;
  std::filesystem::path folder;  // for the logs; empty: no logs
  bool measure_cost = false;
  bool keep_trace = true;
};

// `advanced` is told the virtual seconds flown, about ten times per second of flight. `stop`: ends at the next such point.
FlightOutcome fly(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request, RunFolder* folder,
                  const std::function<void(double)>& advanced, const std::atomic<bool>* stop);

// What the loop of this request is made of; also used by tests that replay a flight's frames.
LoopConfig loop_config(const Scenario& scenario, const Inputs& inputs, const FlightRequest& request);
double flight_duration_s(const Inputs& inputs, const FlightRequest& request);

}  // namespace rotorloop::bench
