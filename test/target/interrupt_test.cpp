// Cycles of the sample interrupt of the linked program over all that a motor does, and a bus full of frames beside it: the figures of
// docs/acceptance/silicon.md.
#include <gtest/gtest.h>

#include <map>

#include "host/tools/commission.hpp"
#include "test/target/safety_rows.hpp"

namespace rotorloop::safety {
namespace {

constexpr std::uint32_t kSampleException = 16 + 18;
constexpr double kLoopLimit_us = 2000.0;
constexpr double kPeriod_cycles = 4.0 * 1771.0, kSamples_Hz = 170e6 / kPeriod_cycles;

// What ran since the last call. One that runs now goes on.
Served take(Bench& b) {
  Served& now = b.core().served[kSampleException];
  const Served s = now;
  now = {.begun_cycle = s.begun_cycle, .begun_waits = s.begun_waits};
  b.bus.chip.core().restored();
  return s;
}

struct Limits {
  double mean, longest;
};
constexpr Limits kMotor{2700.0, 3600.0};
// Commissioning misses these (docs/acceptance/silicon.md). What is guarded here, set in view of what was measured: the mean leaves the main
// loop a tenth of the time, and no interrupt lasts two periods, which would lose a sample.
constexpr Limits kCommissioning{6400.0, 2.0 * kPeriod_cycles};

// Interrupts that outlast a sample period, looked at every few microseconds.
class Overlong {
 public:
  void look(Bench& b) {
    const CoreState& s = b.core();
    const Served& served = s.served[kSampleException];
    if (s.ipsr != kSampleException) return;
    if (served.count != of_) places_.clear();
    of_ = served.count;
    places_.push_back(s.r[kPc]);
    if (static_cast<double>(s.cycle - served.begun_cycle) <= kPeriod_cycles) return;
    const unsigned on = b.watch.gates();
    if (on != 0 && on != kHighSides && on != (kAllSides & ~kHighSides)) with_voltage = true;
    found_[of_] = places_;
  }
  // How often the processor was found in which function.
  void print() const {
    const ElfFile elf = read_elf(program());
    std::map<std::string, int> times;
    for (const auto& [interrupt, places] : found_) {
      for (const std::uint32_t place : places) {
        const ElfSymbol* const function = elf.symbol_at(place);
        ++times[function != nullptr ? function->name : "other"];
      }
    }
    std::printf("%zu interrupts beyond a period of %.0f cycles; the processor was found in\n", found_.size(), kPeriod_cycles);
    for (const auto& [function, n] : times) std::printf("  %d times %s\n", n, function.c_str());
  }
  bool with_voltage = false;  // in one of them the gates put a voltage on the motor

 private:
  std::uint64_t of_ = 0;
  std::vector<std::uint32_t> places_;
  std::map<std::uint64_t, std::vector<std::uint32_t>> found_;
};

void expect_phase(Bench& b, const char* phase, double lasted_s, const Limits& limits = kMotor) {
  const Served s = take(b);
  ASSERT_GT(s.count, 0u) << phase;
  const auto count = static_cast<double>(s.count);
  const double mean = static_cast<double>(s.cycles) / count, zero_wait = static_cast<double>(s.cycles - s.waits) / count;
  std::printf("| %s | %.0f, %lu | %.0f, %lu | %lu |\n", phase, mean, static_cast<unsigned long>(s.longest_cycles), zero_wait,
              static_cast<unsigned long>(s.longest_cycles - s.longest_waits), static_cast<unsigned long>(s.count));
  EXPECT_LE(mean, limits.mean) << phase;
  EXPECT_LE(static_cast<double>(s.longest_cycles), limits.longest) << phase;
  EXPECT_NEAR(count, kSamples_Hz * lasted_s, 2.0) << phase << ": an interrupt is missing";
}

// The longest time between two turns of the main loop that fed the watchdog.
double longest_turn_us(Bench& b, std::int64_t duration_ns, int rpm) {
  double longest_us = 0.0, turned_s = b.watch.now_s();
  std::uint64_t resets_at = b.bus.chip.blocks().iwdg.next_event();
  for (const std::int64_t end_ns = b.tool.now_ns() + duration_ns; b.tool.now_ns() < end_ns;) {
    if (b.tool.now_ns() % (10 * kMs) < kMs / 20) b.set_point(rpm);
    b.tool.run_for(kMs / 20);
    const std::uint64_t now = b.bus.chip.blocks().iwdg.next_event();
    if (now == resets_at) continue;
    longest_us = std::max(longest_us, 1e6 * (b.watch.now_s() - turned_s));
    turned_s = b.watch.now_s();
    resets_at = now;
  }
  return longest_us;
}

TEST(SampleInterrupt, FromStandstillOverStepsAndATripTakes2700CyclesInTheMeanAnd3600AtMost) {
  Bench b(program());
  b.tool.run_until(3000 * kMs, [&] { return b.operational(); });
  std::printf("| phase | mean, longest | with zero wait states | interrupts |\n| --- | --- | --- | --- |\n");
  take(b);
  b.command(700 * kMs);
  EXPECT_NEAR(b.rpm(), kRpm, 0.02 * kRpm);
  expect_phase(b, "start to 3 000 rpm", 0.7);
  for (const int rpm : {9000, 3000, 12000, 6000}) b.command(300 * kMs, rpm);
  expect_phase(b, "steps 9 000, 3 000, 12 000, 6 000 rpm", 1.2);
  b.watch.stuck_pin = 0;  // the divider of the bus voltage
  b.watch.stuck_V = 3.3;
  b.command(20 * kMs, 6000);
  EXPECT_EQ(b.watch.gates(), 0u) << "no trip";
  b.watch.stuck_pin = kNoPin;
  b.command(1200 * kMs, 6000);
  EXPECT_NEAR(b.rpm(), 6000.0, 120.0);
  expect_phase(b, "trip by overvoltage, catch, 6 000 rpm", 1.22);
}

TEST(SampleInterrupt, WhileItCommissionsTakesLessThanTwoPeriodsAtMost) {
  Bench b(program());
  b.tool.run_until(3000 * kMs, [&] { return b.operational(); });
  b.tool.run_for(1000 * kMs);
  tools::Commission commission(b.tool, kNode, {}, [](const std::string&) {});
  commission.begin();
  take(b);
  const double begun_s = b.watch.now_s();
  Overlong overlong;
  for (int ms = 0; ms < 60'000 && !commission.over(); ++ms) {
    commission.step(true);
    for (const std::int64_t end_ns = b.tool.now_ns() + kMs; b.tool.now_ns() < end_ns;) {
      b.tool.run_for(kMs / 200);
      overlong.look(b);
    }
  }
  overlong.print();
  std::printf("with a voltage at the motor in one of them: %s\n", overlong.with_voltage ? "yes" : "no");
  EXPECT_EQ(commission.state(), "done");
  expect_phase(b, "commissioning", b.watch.now_s() - begun_s, kCommissioning);
}

TEST(SampleInterrupt, UnderABusFullOfFramesOfOthersIsNeverLateAndTheMainLoopComesRoundWithin2ms) {
  sim::BusFault flood{.kind = sim::BusFaultKind::extra_traffic, .port = sim::kEveryPort, .at_ns = 2000 * kMs, .duration_ns = 400 * kMs};
  flood.frame = {.id = 0x1801'5503, .extended = true, .length = 8, .data = {}};  // after all that an ESC awaits
  Bench b(program(), {flood});
  b.tool.run_until(1000 * kMs, [&] { return b.operational(); });
  b.command(2000 * kMs - b.tool.now_ns());
  take(b);
  const double begun_s = b.watch.now_s(), longest_us = longest_turn_us(b, 400 * kMs, kRpm);
  expect_phase(b, "3 000 rpm, bus full of frames of others", b.watch.now_s() - begun_s);
  std::printf("longest turn of the main loop %.0f us\n", longest_us);
  EXPECT_NEAR(b.rpm(), kRpm, 0.02 * kRpm) << "set-points did not come through";
  EXPECT_GT(longest_us, 200.0);
  EXPECT_LE(longest_us, kLoopLimit_us);
}

}  // namespace
}  // namespace rotorloop::safety
