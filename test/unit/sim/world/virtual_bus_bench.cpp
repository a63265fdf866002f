// Cost of the bus and of a recorder, per frame. Budget: 300 ns with delivery to 5 ports, 100 ns for a candump line.
#include <benchmark/benchmark.h>

#include "host/bus/candump_log.hpp"
#include "host/bus/frame_bits.hpp"
#include "test/unit/sim/world/bus_fixture.hpp"

namespace rotorloop::sim {
namespace {

// The fast channel: a set-point to four ESCs, four answers, one state frame, per millisecond; polled as nodes do.
void fast_channel(benchmark::State& state) {
  VirtualBus bus({});
  std::vector<CanBus*> port;
  for (int i = 0; i < 6; ++i) port.push_back(&bus.attach({.name = "node"}));
  std::int64_t now_ns = 0;
  std::uint64_t n = 0, got = 0;
  for (auto _ : state) {
    for (std::uint32_t i = 0; i < 6; ++i) {
      CanFrame f{.id = 0x140 + i, .length = static_cast<std::uint8_t>(i == 0 ? 8 : 4)};
      for (std::size_t k = 0; k < 8; ++k) f.data[k] = static_cast<std::uint8_t>(n * 0x9E3779B97F4A7C15ull >> (8 * k));
      ++n;
      port[i]->send(f);
    }
    now_ns += kNs_per_ms;
    bus.advance_to(now_ns);
    for (CanBus* p : port) {
      while (p->receive()) ++got;
    }
  }
  benchmark::DoNotOptimize(got);
  state.SetItemsProcessed(static_cast<std::int64_t>(n));
}
BENCHMARK(fast_channel);

void idle_advance(benchmark::State& state) {
  VirtualBus bus({});
  bus.attach({.name = "a"});
  std::int64_t tick = 0;
  for (auto _ : state) bus.advance_to(pwm_tick_ns(++tick));
}
BENCHMARK(idle_advance);

void bits_of_a_frame(benchmark::State& state) {
  CanFrame f{.id = 0x123, .length = 8};
  for (auto _ : state) {
    f.data[0] = static_cast<std::uint8_t>(f.data[0] + 1);
    benchmark::DoNotOptimize(frame_bits(f));
  }
}
BENCHMARK(bits_of_a_frame);

void candump_line(benchmark::State& state) {
  CandumpWriter writer("/dev/null", "vcan0");
  CanFrame f{.id = 0x1234567, .extended = true, .length = 8};
  std::int64_t now_ns = 0;
  for (auto _ : state) writer.write(now_ns += 123'456, f);
}
BENCHMARK(candump_line);

}  // namespace
}  // namespace rotorloop::sim

BENCHMARK_MAIN();
