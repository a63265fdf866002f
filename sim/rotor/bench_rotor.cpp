// Speed of the BEM rotor model over a sequence of states as from a flight: run build/release/bin/bench_rotor. Not part of ctest.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "sim/rotor/bem.hpp"

namespace {
using namespace rotorloop::sim;

// One minute at 1 kHz of weaving between hover and 10 m/s with climbs, body rates and changing rotor speed.
std::vector<RotorCondition> flight() {
  std::vector<RotorCondition> out;
  for (int i = 0; i < 60000; ++i) {
    const double t = i * 1e-3;
    RotorCondition c;
    c.v_R_m_s = {5.0 + 5.0 * std::sin(0.9 * t), 3.0 * std::sin(0.7 * t + 1.0), 2.5 * std::sin(1.3 * t)};
    c.w_R_rad_s = {3.0 * std::sin(4.1 * t), 3.0 * std::sin(3.3 * t), 1.0 * std::sin(2.0 * t)};
    c.omega_rad_s = 980.0 + 150.0 * std::sin(5.0 * t) + 30.0 * std::sin(37.0 * t);
    c.density_kg_m3 = 1.2;
    out.push_back(c);
  }
  return out;
}

void solve(benchmark::State& state, bool warm_start, int radial, int azimuth, RotorKernel kernel = fastest_rotor_kernel()) {
  if (!runs_here(kernel)) return state.SkipWithError("this CPU lacks the instructions");
  const Rotor rotor(read_blade(ROTORLOOP_SOURCE_DIR "/vehicles/blades/triblade_5in.toml"), {radial, azimuth});
  const auto conditions = flight();
  RotorWarmStart warm;
  std::size_t i = 0;
  long iterations = 0;
  for (auto _ : state) {
    if (!warm_start) warm.valid = false;
    const RotorLoads loads = solve_rotor(rotor, conditions[i], warm, kernel);
    iterations += loads.iterations;
    benchmark::DoNotOptimize(loads.shaft_torque_N_m);
    if (++i == conditions.size()) i = 0;
  }
  state.SetItemsProcessed(state.iterations());
  state.counters["iterations_of_slowest_annulus"] = static_cast<double>(iterations) / static_cast<double>(state.iterations());
}
}  // namespace

BENCHMARK_CAPTURE(solve, flight_warm_12x16, true, 12, 16);
BENCHMARK_CAPTURE(solve, flight_warm_12x16_baseline, true, 12, 16, RotorKernel::baseline);
BENCHMARK_CAPTURE(solve, flight_warm_12x16_v3, true, 12, 16, RotorKernel::v3);
BENCHMARK_CAPTURE(solve, flight_warm_12x16_v4, true, 12, 16, RotorKernel::v4);
BENCHMARK_CAPTURE(solve, flight_cold_12x16, false, 12, 16);
BENCHMARK_CAPTURE(solve, flight_warm_22x16, true, 22, 16);
BENCHMARK_CAPTURE(solve, flight_warm_64x128, true, 64, 128);
BENCHMARK_MAIN();
