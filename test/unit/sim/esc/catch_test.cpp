// Rotors of low inductance that already turn when the set-point comes. What a zero-voltage bridge would let through is far beyond any trip:
// 9 V of EMF drive 65 A through 5.9 uH in one sample.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "bench/hil/esc_lab/esc_run.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::esc_lab;
using firmware::MotorState;

// A 2306 of 1 800 rpm/V; typical data. Its propeller slows it by 24 000 rad/s² at full speed.
EscDraw low_inductance_5in(int cells, double inductance_H, std::uint64_t seed) {
  const MotorClass c{"5in 1800", LabBoard::b_g431b_esc1, cells, 1800, 7, 0.030, inductance_H, 3.4e-6, 4.4e-6, 2.1e-8, 2.5e-3, 1e-3, 30.0,
                     600.0};
  return draw_esc(c, seed, Knowledge::data_sheet);
}

double top_rad_s(const EscDraw& d) {
  const sim::MotorParameters& m = d.drive.motor;
  return std::min(0.9 * d.bus_V / (std::numbers::sqrt3 * m.flux_linkage_Wb * m.pole_pairs), 200e3 / m.pole_pairs * kRpm);
}

struct Caught {
  double after_ms = 1e9, peak_A = 0.0;
  int trips = 0;
};
Caught catch_at(double share, const EscDraw& d, bool pulsed = true) {
  EscRun<sim::NativeEsc> run(d, false);
  if (!pulsed) {
    auto& finder = run.esc().motor().config().finder;
    finder.forward_e_rad_s = finder.backward_e_rad_s = 1e9f;  // no rotor is fast enough: the windings are shorted at once
  }
  run.esc().drive().motor().state().omega_rad_s = share * top_rad_s(d);
  run.count_anew();
  run.order(speed(0.6 * top_rad_s(d)));
  Caught c;
  run.run_ms(200.0, [&](double ms) {
    const MotorState s = run.esc().telemetry().state;
    if (s == MotorState::running || s == MotorState::handover) c.after_ms = std::min(c.after_ms, ms);
  });
  c.trips = run.trips();
  c.peak_A = run.peak_A();
  return c;
}

TEST(Catch, ARotorOf6MicrohenryIsCaughtWithin20MsFrom20To90PercentOfItsSpeedWithoutATripAtFourAndSixCells) {
  double latest_ms = 0.0, peak_A = 0.0;
  for (const int cells : {4, 6})
    for (const double share : {0.2, 0.5, 0.9, -0.5, -0.9})
      for (const std::uint64_t seed : {801u, 802u}) {
        const Caught c = catch_at(share, low_inductance_5in(cells, 5.9e-6, seed));
        EXPECT_LT(c.after_ms, 20.0) << cells << " cells, " << share << ", seed " << seed;
        EXPECT_EQ(c.trips, 0) << cells << " cells, " << share << ", seed " << seed;
        latest_ms = std::max(latest_ms, c.after_ms);
        peak_A = std::max(peak_A, c.peak_A);
      }
  std::printf("caught within %.1f ms, peak %.0f A\n", latest_ms, peak_A);
}

TEST(Catch, WithoutThePulsesTheSameRotorTrips) {
  for (const std::uint64_t seed : {801u, 802u}) EXPECT_GT(catch_at(0.9, low_inductance_5in(6, 5.9e-6, seed), false).trips, 0);
}

}  // namespace
