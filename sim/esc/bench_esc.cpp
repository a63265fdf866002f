// Cost of one 24 kHz period of a native ESC, whole and in parts. Budget: 400 ns for the whole, so that four ESCs take less than
// 40 ms per simulated second. `bench_esc --benchmark_min_time=1`
#include <benchmark/benchmark.h>

#include <array>

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

// As the loop runs them: the drives of four ESCs step side by side. Per ESC.
void whole_period_four_together(benchmark::State& state) {
  std::array<NativeEsc, 4> escs{running_esc(), running_esc(), running_esc(), running_esc()};
  const std::array<NativeEsc*, 4> pointers{&escs[0], &escs[1], &escs[2], &escs[3]};
  for (auto _ : state) {
    NativeEsc::step_current_loops(pointers);
    benchmark::DoNotOptimize(escs[3].omega_rad_s());
  }
  state.counters["per_esc"] =
      benchmark::Counter(4.0 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK(whole_period_four_together);

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
