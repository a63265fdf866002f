// Seeded schedules of faults, each from a copy of an ESC that starts or flies on a drawn board: one or two things break at random times,
// for a while or for good, and the set-point is renewed or not. Whatever happens, nothing is driven without a fresh set-point, and an ESC
// that does not drive though it should says why. ROTORLOOP_FAULT_SCHEDULES sets their number.
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <map>
#include <string>

#include "test/unit/sim/esc/rpm_loop_measure.hpp"

namespace {

using namespace rotorloop;
using namespace rotorloop::sim;
using firmware::Blocked;
using firmware::MotorState;

constexpr std::uint64_t kStream = 0x4641554C;
constexpr double kLength_ms = 450.0, kStale_ms = 22.0;  // an order lives for 20 ms, supervision looks every 0.25 ms
constexpr double kBlindRunning_ms = 150.0;              // for which a rotor at rest may be reported as running

struct Outcome {
  double driven_stale_ms = 0.0, blind_running_ms = 0.0;
  bool dead_without_reason = false, latched_without_fault = false, latched = false, tripped = false;
  std::string faults;
};

NativeEsc snapshot(std::uint64_t seed, double after_ms) {
  NativeEscConfig c;
  c.seed = seed;
  c.bus_V = seed % 2 == 0 ? 14.0 : 16.8;
  c.typical_board = true;
  NativeEsc esc = make_esc(c);
  esc.set_setpoint(speed(9000 * kRpm));
  run_ms(esc, after_ms);
  return esc;
}

Outcome fly(NativeEsc esc, std::uint64_t number) {
  const RandomStream random(number, kStream);
  Outcome o;
  const double now_s = esc.drive().time_s();
  const int faults = random.uniform(0) < 0.5 ? 1 : 2;
  for (int k = 0; k < faults; ++k) {
    const std::uint64_t n = 10 + 10 * static_cast<std::uint64_t>(k);
    DriveFault f;
    f.kind = static_cast<DriveFaultKind>(static_cast<int>(random.uniform(n) * static_cast<double>(kDriveFaultNames.size())));
    f.phase = static_cast<std::uint8_t>(3.0 * random.uniform(n + 1));
    f.from_s = now_s + 0.1 * random.uniform(n + 2);
    f.until_s = random.uniform(n + 3) < 0.5 ? f.from_s + 0.01 + 0.2 * random.uniform(n + 4) : std::numeric_limits<double>::infinity();
    f.size = f.kind == DriveFaultKind::weak_magnets ? 0.5 + 0.5 * random.uniform(n + 5) : 0.4 * random.uniform(n + 5);
    esc.drive().add_fault(f);
    o.faults += std::string(kDriveFaultNames[static_cast<std::size_t>(f.kind)]) + " ";
  }
  const double silent_from_ms = random.uniform(1) < 0.5 ? kLength_ms * random.uniform(2) : std::numeric_limits<double>::infinity();
  double blind_ms = 0.0;
  run_ms(esc, kLength_ms, [&](double ms) {
    // What is no number renews no order.
    if (ms >= silent_from_ms) esc.set_setpoint({firmware::Mode::speed, std::numeric_limits<float>::quiet_NaN()});
    if (ms > silent_from_ms + kStale_ms && esc.board().bridge) o.driven_stale_ms += 1.0 / kPeriodsPerMs;
    const bool blind = esc.telemetry().state == MotorState::running && std::fabs(esc.omega_rad_s()) < 10.0;
    blind_ms = blind ? blind_ms + 1.0 / kPeriodsPerMs : 0.0;
    o.blind_running_ms = std::max(o.blind_running_ms, blind_ms);
  });
  const firmware::Telemetry t = esc.telemetry();
  const bool asked = silent_from_ms > kLength_ms;
  const bool reason = t.blocked != Blocked::none && t.blocked != Blocked::no_order && t.blocked != Blocked::stale_order;
  o.dead_without_reason = asked && !esc.board().bridge && !reason;
  o.latched = t.latched;
  o.latched_without_fault = t.latched && t.fault == firmware::Fault::none;
  o.tripped = t.trips > 0;
  return o;
}

TEST(FaultSchedule, NothingIsDrivenWithoutAFreshSetpointAndNothingStaysDeadWithoutAReason) {
  const char* asked = std::getenv("ROTORLOOP_FAULT_SCHEDULES");
  const std::uint64_t schedules = asked != nullptr ? std::strtoull(asked, nullptr, 10) : 60;
  constexpr std::uint64_t kBoards = 5;
  std::vector<NativeEsc> begun;
  for (std::uint64_t seed = 1; seed <= kBoards; ++seed) {
    begun.push_back(snapshot(seed, 20.0 + 60.0 * static_cast<double>(seed)));  // aligning, ramping, handing over
    begun.push_back(snapshot(seed, 900.0));                                    // at speed
  }
  std::uint64_t tripped = 0, latched = 0;
  for (std::uint64_t n = 1; n <= schedules; ++n) {
    const Outcome o = fly(begun[n % begun.size()], n);
    tripped += o.tripped, latched += o.latched;
    ASSERT_EQ(o.driven_stale_ms, 0.0) << "schedule " << n << ": " << o.faults;
    EXPECT_FALSE(o.dead_without_reason) << "schedule " << n << ": " << o.faults;
    EXPECT_FALSE(o.latched_without_fault) << "schedule " << n << ": " << o.faults;
    EXPECT_LT(o.blind_running_ms, kBlindRunning_ms) << "schedule " << n << ": " << o.faults;
  }
  std::printf("%llu schedules of faults: %llu with a trip, %llu latched at their end\n", static_cast<unsigned long long>(schedules),
              static_cast<unsigned long long>(tripped), static_cast<unsigned long long>(latched));
  EXPECT_GT(tripped, schedules / 10);  // the faults do something
}

// The same schedules judge a core whose orders never expire: they must find it.
TEST(FaultSchedule, AnEscWhoseOrdersNeverExpireIsFoundByThem) {
  NativeEsc esc = snapshot(1, 900.0);
  esc.motor().config().order_ticks = 1u << 30;
  double driven_ms = 0.0;
  for (std::uint64_t n = 1; n <= 10; ++n) driven_ms += fly(esc, n).driven_stale_ms;
  EXPECT_GT(driven_ms, 50.0);
}

}  // namespace
