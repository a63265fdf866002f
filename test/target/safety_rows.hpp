// A row of the table of failures: what is injected, how long the gates may stay on, and what then becomes of the motor.
#pragma once
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>

#include "test/target/safety_bench.hpp"

namespace rotorloop::safety {

inline std::string& program() {  // path of the ELF
  static std::string path;
  return path;
}

enum class Then : std::uint8_t {
  restarts,  // a reset, and it turns again with the set-points that go on
  stops,     // no reset; gates low to the end
  goes_on,   // no reset; at its speed
  safe,      // any of the three
};
inline constexpr const char* kThenText[] = {"restarts and turns again", "stops", "goes on", ""};

struct Injection {
  const char* what;
  double limit_us;  // to gates low; 0: not asked for
  Then then;
  std::function<void(Bench&)> inject;
  bool commanded = true;        // set-points go on
  bool from_exception = false;  // the time begins when the processor meets what was injected, with the exception of a fault
};

// What was injected is met with the next sample: a sample period, and the entry of the exception with its registers (27 cycles and waits).
inline constexpr double kMetAfter_us = 1e6 * 4.0 * 1771.0 / 170e6 + 0.5;

struct Seen {
  double gates_low_us;
  std::optional<double> met_after_us;  // of the exception, where one is awaited
  double rpm;
  std::uint64_t resets;
  unsigned gates;
  bool program_refused;
};

// The motor turns at 3 000 rpm; made once.
inline Bench& turning() {
  static Bench* const bench = [] {
    auto* const b = new Bench(program());
    b->tool.run_until(3000 * kMs, [&] { return b->operational(); });
    b->command(1200 * kMs);
    b->until_in(0);
    return b;
  }();
  return *bench;
}

inline Seen judge(Bench& b, const Injection& i, std::int64_t window_ns) {
  const std::uint64_t resets = b.bus.chip.resets();
  i.inject(b);
  const std::optional<double> met_after_us = i.from_exception ? b.until_fault_us() : std::nullopt;
  b.watch.begin();
  if (i.commanded)
    b.command(window_ns);
  else
    b.pass(window_ns);
  return {1e6 * b.watch.quiet_after_s(), met_after_us, b.rpm(), b.bus.chip.resets() - resets, b.watch.gates(), b.bus.end != End::at_cycle};
}

inline void expect(const Injection& i, const Seen& s) {
  std::printf("| %s | ", i.what);
  s.gates_low_us < 1e9 ? std::printf("%.1f", s.gates_low_us) : std::printf("–");
  if (s.met_after_us) std::printf(" after an exception %.1f after the injection", *s.met_after_us);
  i.limit_us > 0 ? std::printf(" | %.0f", i.limit_us) : std::printf(" | –");
  const bool at_speed = std::abs(s.rpm - kRpm) < 0.05 * kRpm;
  const char* const end = s.resets > 0   ? (at_speed ? kThenText[0] : "restarts")
                          : at_speed     ? kThenText[2]
                          : s.gates == 0 ? "stops"
                                         : "other";
  std::printf(" | %s, %.0f rpm; resets %lu |\n", end, s.rpm, static_cast<unsigned long>(s.resets));
  EXPECT_FALSE(s.program_refused) << "the program did what the chip does not have";
  if (i.from_exception) {
    ASSERT_TRUE(s.met_after_us) << "no exception came: the time to gates low has no beginning";
    EXPECT_LE(*s.met_after_us, kMetAfter_us) << "us from the injection to the exception";
  }
  if (i.limit_us > 0) {
    EXPECT_LE(s.gates_low_us, i.limit_us) << "us to gates low";
  }
  if (i.then == Then::restarts) {
    EXPECT_EQ(s.resets, 1u);
    EXPECT_TRUE(at_speed) << s.rpm << " rpm";
  }
  if (i.then == Then::goes_on) {
    EXPECT_EQ(s.resets, 0u);
    EXPECT_TRUE(at_speed) << s.rpm << " rpm";
  }
  if (i.then == Then::stops) {
    EXPECT_EQ(s.resets, 0u);
    EXPECT_EQ(s.gates, 0u);
  }
}

inline void run(const std::vector<Injection>& rows, std::int64_t window_ns) {
  ASSERT_NEAR(turning().rpm(), kRpm, 0.02 * kRpm);
  for (const Injection& i : rows) {
    SCOPED_TRACE(i.what);
    const auto seen = in_a_fork([&] { return judge(turning(), i, window_ns); });
    ASSERT_TRUE(seen) << "its process did not end well";
    expect(i, *seen);
  }
}

}  // namespace rotorloop::safety
