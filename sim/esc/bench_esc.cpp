// Cost of one 24 kHz period of a native ESC, whole and in parts. Budget: 400 ns for the whole, so that four ESCs take less than
// 40 ms per simulated second. `bench_esc --benchmark_min_time=1`
#include <benchmark/benchmark.h>

#include "sim/esc/native_esc.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;

NativeEsc running_esc() {
  NativeEscConfig c;
  c.bus_V = 15.2;
  NativeEsc esc(c);
  esc.couple_quadratic(2.9e-8, 15.2);
  esc.set_setpoint({firmware::Mode::speed, 900.0f});
  for (int k = 0; k < 24000; ++k) esc.step_current_loop();
  return esc;
}

void whole_period(benchmark::State& state) {
  NativeEsc esc = running_esc();
  for (auto _ : state) {
    esc.step_current_loop();
    benchmark::DoNotOptimize(esc.omega_rad_s());
  }
}
BENCHMARK(whole_period);

void two_pwm_periods_of_the_drive(benchmark::State& state) {
  NativeEsc esc = running_esc();
  const PwmCommand pwm{{900, 880, 870}, 1771, true};
  for (auto _ : state) {
    benchmark::DoNotOptimize(esc.drive().sample());
    esc.drive().step(pwm);
    esc.drive().step(pwm);
  }
}
BENCHMARK(two_pwm_periods_of_the_drive);

void firmware_interrupt(benchmark::State& state) {
  NativeEsc esc = running_esc();
  firmware::FakeBoard board = esc.board();
  for (auto _ : state) {
    esc.motor().on_sample(board);
    benchmark::DoNotOptimize(board.compare);
  }
}
BENCHMARK(firmware_interrupt);

}  // namespace

BENCHMARK_MAIN();
