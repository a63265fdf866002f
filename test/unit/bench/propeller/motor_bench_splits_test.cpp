// Whether the two rows that the motor bench holds out were lucky ones: every other choice of two, fitted anew. About three minutes.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "bench/propeller/motor_bench.hpp"

namespace rotorloop::propeller {
namespace {

TEST(MeasuredMotorBench, AnyTwoHeldOutRowsAreWithinTheLimitsInTheRootMeanSquare) {
  if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set: motor bench not checked";
  const MotorBenchData data = read_motor_bench_data(std::getenv("ROTORLOOP_DATA"));
  const sim::Blade blade = sim::read_blade(ROTORLOOP_SOURCE_DIR "/vehicles/blades/triblade_5in.toml");
  const LeaveTwoOut all = leave_two_out(data, blade, fit_motor_bench(data, blade).parameters);
  std::printf("[ measured ] %d choices, %d wholly within the limits; rms rpm %.2f %%, A %.2f %%, N %.2f %%; worst %.2f, %.2f, %.2f %%\n",
              all.choices, all.within, 100 * all.rms.omega_rad_s, 100 * all.rms.bus_A, 100 * all.rms.thrust_N, 100 * all.worst.omega_rad_s,
              100 * all.worst.bus_A, 100 * all.worst.thrust_N);
  EXPECT_EQ(all.choices, 45);
  EXPECT_LT(all.rms.omega_rad_s, kBenchLimits.omega);
  EXPECT_LT(all.rms.bus_A, kBenchLimits.bus_A);
  EXPECT_LT(all.rms.thrust_N, kBenchLimits.thrust);
}

// A plain resistance in place of the volts that every commutation costs.
TEST(MeasuredMotorBench, WithoutTheCommutationDropAllThreeLimitsAreMissed) {
  if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set: motor bench not checked";
  BenchParameters start;
  start.phase_inductance_H = 0.0;
  start.resistance_ohm = 0.15;
  start.chord_scale = 0.5;
  const MotorBenchResult r = fit_motor_bench(
      read_motor_bench_data(std::getenv("ROTORLOOP_DATA")), sim::read_blade(ROTORLOOP_SOURCE_DIR "/vehicles/blades/triblade_5in.toml"),
      {BenchScalar::resistance, BenchScalar::chord, BenchScalar::drag, BenchScalar::twist}, {3, 7}, start);
  EXPECT_GT(r.worst_held_out.omega_rad_s, kBenchLimits.omega);
  EXPECT_GT(r.worst_held_out.bus_A, kBenchLimits.bus_A);
  EXPECT_GT(r.worst_held_out.thrust_N, kBenchLimits.thrust);
}

}  // namespace
}  // namespace rotorloop::propeller
