// Schedules of faults (bench/hil/esc_lab/fault_schedule.hpp) over five drawn boards and motors. ROTORLOOP_FAULT_SCHEDULES sets their
// number.
#include "bench/hil/esc_lab/fault_schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>

namespace {

using namespace rotorloop::esc_lab;

// Ten seconds of one core for the fast tier; the full tier asks for 10 000.
constexpr std::uint64_t kSchedules = 1500;

std::vector<EscDraw> drawn_5in_motors() {
  std::vector<EscDraw> draws;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) draws.push_back(draw_esc(*find_motor_class("5in"), seed, Knowledge::data_sheet));
  return draws;
}

TEST(FaultSchedule, NothingIsDrivenWithoutAFreshSetpointAndNothingStaysDeadWithoutAReason) {
  const char* asked = std::getenv("ROTORLOOP_FAULT_SCHEDULES");
  const std::uint64_t schedules = asked != nullptr ? std::strtoull(asked, nullptr, 10) : kSchedules;
  std::uint64_t tripped = 0, latched = 0, flown = 0;
  double longest_ms = 0.0, blind_ms = 0.0;
  FaultSettings s{.count = schedules};
  s.each = [&](const FaultOutcome& o) {
    ++flown;
    tripped += o.tripped;
    latched += o.latched;
    longest_ms = std::max(longest_ms, o.simulated_ms);
    blind_ms = std::max(blind_ms, o.blind_running_ms);
    EXPECT_EQ(fault_failure(o), "") << "schedule " << o.number << ": " << o.faults;
  };
  run_fault_schedules(drawn_5in_motors(), s);
  std::printf("%llu schedules of faults: %llu with a trip, %llu latched at their end; at most %.0f ms simulated, %.0f ms blind\n",
              static_cast<unsigned long long>(flown), static_cast<unsigned long long>(tripped), static_cast<unsigned long long>(latched),
              longest_ms, blind_ms);
  EXPECT_EQ(flown, schedules);
  EXPECT_LE(longest_ms, 500.0);
  EXPECT_GT(tripped, schedules / 10);  // the faults do something
}

// The same schedules judge a core whose orders never expire: they must find it.
TEST(FaultSchedule, AnEscWhoseOrdersNeverExpireIsFoundByThem) {
  FaultSettings s{.count = 30};
  s.change = [](rotorloop::firmware::MotorConfig& c) { c.order_ticks = 1u << 30; };
  double driven_ms = 0.0;
  for (const FaultOutcome& o : run_fault_schedules(drawn_5in_motors(), s)) driven_ms += o.driven_stale_ms;
  EXPECT_GT(driven_ms, 50.0);
}

// Alone and four side by side, traced and not: schedule 17 is schedule 17, so that a failure can be looked at.
TEST(FaultSchedule, OneOfThemRunAloneEndsAsItDidAmongTheOthers) {
  const FaultSettings s{.count = 40};
  const auto all = run_fault_schedules(drawn_5in_motors(), s);
  for (const std::uint64_t number : {7u, 17u, 32u}) {
    EscTrace trace;
    const FaultOutcome alone = trace_fault_schedule(drawn_5in_motors(), s, number, trace);
    const auto among = std::find_if(all.begin(), all.end(), [&](const FaultOutcome& o) { return o.number == number; });
    ASSERT_NE(among, all.end());
    EXPECT_EQ(alone.faults, among->faults);
    EXPECT_EQ(alone.simulated_ms, among->simulated_ms);
    EXPECT_EQ(alone.tripped, among->tripped);
    EXPECT_EQ(alone.latched, among->latched);
    EXPECT_NEAR(trace.t_s.back(), 1e-3 * alone.simulated_ms, 0.3e-3);
  }
}

// Broken legs are stepped edge by edge: in steps of 1 us here, of 0.25 us where the bridge itself is judged (test_drive).
TEST(FaultSchedule, StepsOfOneMicrosecondEndAsThoseOfAQuarter) {
  FaultSettings coarse{.count = 60}, fine{.count = 60};
  fine.switched_step_s = 0.25e-6;
  const auto by_number = [](std::vector<FaultOutcome> all) {
    std::sort(all.begin(), all.end(), [](const FaultOutcome& a, const FaultOutcome& b) { return a.number < b.number; });
    return all;
  };
  const auto a = by_number(run_fault_schedules(drawn_5in_motors(), coarse)), b = by_number(run_fault_schedules(drawn_5in_motors(), fine));
  int same = 0;
  for (std::size_t k = 0; k < a.size(); ++k) same += a[k].tripped == b[k].tripped && a[k].latched == b[k].latched;
  std::printf("%d of %zu schedules end alike\n", same, a.size());
  EXPECT_GE(same, 57);  // a single count of noise more or less may decide between two trips and none
}

}  // namespace
