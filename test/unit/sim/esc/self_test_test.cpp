// Every fault that the self-test promises to find, on drawn motors and boards of all classes; healthy ones, and rotors that the wind turns.
// Seeds 1 to 7000 are for development, the judged ones begin at 7001. ROTORLOOP_SELF_TESTS: healthy power-ups, 320 unless said;
// ROTORLOOP_SELF_TEST_FROM: first seed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>

#include "bench/hil/esc_lab/esc_run.hpp"
#include "bench/hil/esc_lab/self_test_trial.hpp"

using namespace rotorloop;
using namespace rotorloop::esc_lab;
using firmware::Broken;
using firmware::SelfTest;

namespace {

constexpr double kMost_A = 5.0, kMost_ms = 200.0, kMost_deg = 30.0;
constexpr std::array<const char*, 7> kNames{"none",           "phase open", "high side open", "low side open", "high side short",
                                            "low side short", "several"};

std::uint64_t number(const char* name, std::uint64_t usual) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : usual;
}
std::uint64_t first_seed() { return number("ROTORLOOP_SELF_TEST_FROM", 7001); }
std::uint64_t healthy_count() { return number("ROTORLOOP_SELF_TESTS", 320); }

const MotorClass& class_of(std::uint64_t k) { return self_test_classes()[k % self_test_classes().size()]; }
std::string text(const SelfTestOutcome& o) {
  return fmt::format("result {}, {} {}, {:.1f} ms, {:.1f} A, shorted {:.1f} us, {:.2f} deg", static_cast<int>(o.result),
                     kNames[static_cast<std::size_t>(o.broken)], "ABC"[o.leg % 3], o.ms, o.peak_A, o.supply_shorted_us, o.turned_deg);
}

// The high side of A and the low side of A are met by the first gate that closes beside them.
bool met_by_chance(const BridgeFault& f) { return f.leg == 0 && (f.what == Broken::high_short || f.what == Broken::low_short); }

}  // namespace

TEST(SelfTestOfTheBridge, FindsAndNamesEachOfFifteenFaultsWithin5A200Ms30DegElectrical) {
  struct Row {
    int found = 0, of = 0;
    double peak_A = 0.0, ms = 0.0, deg = 0.0, shorted_us = 0.0;
  };
  std::map<std::string, Row> rows;
  const std::uint64_t draws = std::max<std::uint64_t>(healthy_count() / 20, self_test_classes().size());
  for (std::uint64_t k = 0; k < draws; ++k) {
    const EscDraw d = draw_for_self_test(class_of(k), first_seed() + k);
    for (const BridgeFault& f : bridge_faults()) {
      const SelfTestOutcome o = run_self_test(d, {.fault = f});
      const bool found = named_rightly(o, f);
      EXPECT_TRUE(found) << d.motor_class << " seed " << d.seed << ", " << kNames[static_cast<std::size_t>(f.what)] << ' ' << "ABC"[f.leg]
                         << ": " << text(o);
      EXPECT_LE(o.ms, kMost_ms) << d.motor_class << " seed " << d.seed << ": " << text(o);
      EXPECT_LE(o.turned_deg, kMost_deg) << d.motor_class << " seed " << d.seed << ": " << text(o);
      EXPECT_LE(o.peak_A, kMost_A) << d.motor_class << " seed " << d.seed << ": " << text(o);
      if (!met_by_chance(f)) {
        EXPECT_EQ(o.supply_shorted_us, 0.0) << d.motor_class << " seed " << d.seed << ": " << text(o);
      }
      const char* const name = kNames[static_cast<std::size_t>(f.what)];
      Row& r = rows[met_by_chance(f) ? fmt::format("{}, leg A, {}", name, d.motor_class) : name];
      r.found += found ? 1 : 0;
      ++r.of;
      r.peak_A = std::max(r.peak_A, o.peak_A);
      r.ms = std::max(r.ms, o.ms);
      r.deg = std::max(r.deg, o.turned_deg);
      r.shorted_us = std::max(r.shorted_us, o.supply_shorted_us);
    }
  }
  fmt::print(
      "| fault | found and named | largest phase current | longest | rotor moved | supply shorted for |\n| --- | --- | --- | --- | --- | "
      "--- |\n");
  for (const auto& [name, r] : rows)
    fmt::print("| {} | {}/{} | {:.1f} A | {:.0f} ms | {:.2f} deg | {:.1f} us |\n", name, r.found, r.of, r.peak_A, r.ms, r.deg,
               r.shorted_us);
}

TEST(SelfTestOfTheBridge, PassesEveryHealthyBridgeOfEveryClass) {
  struct Row {
    int passed = 0, of = 0;
    double peak_A = 0.0, ms = 0.0, deg = 0.0;
  };
  std::map<std::string, Row> rows;
  for (std::uint64_t k = 0; k < healthy_count(); ++k) {
    const EscDraw d = draw_for_self_test(class_of(k), first_seed() + 1000 + k);
    const SelfTestOutcome o = run_self_test(d, {});
    EXPECT_EQ(o.result, SelfTest::passed) << d.motor_class << " seed " << d.seed << ": " << text(o);
    EXPECT_LE(o.peak_A, kMost_A) << d.motor_class << " seed " << d.seed << ": " << text(o);
    EXPECT_LE(o.ms, 0.5 * kMost_ms) << d.motor_class << " seed " << d.seed << ": " << text(o);
    EXPECT_LE(o.turned_deg, kMost_deg) << d.motor_class << " seed " << d.seed << ": " << text(o);
    Row& r = rows[d.motor_class];
    r.passed += o.result == SelfTest::passed ? 1 : 0;
    ++r.of;
    r.peak_A = std::max(r.peak_A, o.peak_A);
    r.ms = std::max(r.ms, o.ms);
    r.deg = std::max(r.deg, o.turned_deg);
  }
  fmt::print("| class, sound | passed | largest phase current | longest | rotor moved |\n| --- | --- | --- | --- | --- |\n");
  for (const auto& [name, r] : rows)
    fmt::print("| {} | {}/{} | {:.1f} A | {:.0f} ms | {:.2f} deg |\n", name, r.passed, r.of, r.peak_A, r.ms, r.deg);
}

// Low inductance at a high voltage: winding and nodes swing for longer after each pulse, with more current.
TEST(SelfTestOfTheBridge, PassesEachOf200SoundBoardsAtSixCellsAndThreeTo15Microhenry) {
  constexpr std::array<double, 4> kInductances_H{3e-6, 5.9e-6, 9e-6, 15e-6};
  for (std::uint64_t k = 0; k < 200; ++k) {
    const double inductance_H = kInductances_H[k % kInductances_H.size()];
    // A 2306 of 1 800 rpm/V; typical data.
    const MotorClass c{"5in 6S", LabBoard::b_g431b_esc1, 6, 1800, 7, 0.030, inductance_H, 5e-6, 4.4e-6, 2.4e-8, 1e-3, 0.7e-3, 40.0, 600.0};
    const SelfTestOutcome o = run_self_test(draw_for_self_test(c, first_seed() + 5000 + k), {});
    EXPECT_EQ(o.result, SelfTest::passed) << 1e6 * inductance_H << " uH, seed " << first_seed() + 5000 + k << ": " << text(o);
  }
}

TEST(SelfTestOfTheBridge, ARotorTurnedByTheWindIsNeverCalledAFault) {
  std::map<std::string, int> results;
  for (std::uint64_t k = 0; k < healthy_count() / 2; ++k) {
    const EscDraw d = draw_for_self_test(class_of(k), first_seed() + 2000 + k);
    // From hardly at all to two thirds of the speed that the supply could turn, both ways.
    const double top_rad_s = 0.95 * d.bus_V / (1.7321 * d.drive.motor.flux_linkage_Wb * d.drive.motor.pole_pairs);
    const double share = 0.003 * std::pow(220.0, static_cast<double>(k * 7 % 40) / 40.0);
    const SelfTestOutcome o = run_self_test(d, {.fault = std::nullopt, .omega_rad_s = (k % 2 == 0 ? share : -share) * top_rad_s});
    EXPECT_NE(o.result, SelfTest::failed) << d.motor_class << " seed " << d.seed << " at " << share << " of the top: " << text(o);
    EXPECT_NE(o.result, SelfTest::due) << d.motor_class << " seed " << d.seed << " at " << share << " of the top: " << text(o);
    ++results[o.result == SelfTest::turning ? "not tested" : o.result == SelfTest::passed ? "passed" : "failed"];
  }
  for (const auto& [name, n] : results) fmt::print("turning rotor: {} {}\n", name, n);
  EXPECT_GT(results["not tested"], 0);
}

namespace {

EscDraw five_inch(std::uint64_t seed) { return draw_for_self_test(*find_motor_class("5in"), seed); }

// Time until an order that is there from power-up on has the bridge driven for good: 20 ms in a row.
double driven_after_ms(const EscDraw& d) {
  sim::NativeEsc esc(native_config(d));
  esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
  esc.set_setpoint(speed(500.0));
  int on = 0;
  for (int k = 0; k < 300 * kPeriodsPerMs; ++k) {
    esc.step_current_loop();
    on = esc.telemetry().state != firmware::MotorState::off ? on + 1 : 0;
    if (on == 20 * kPeriodsPerMs) return (k + 1) / static_cast<double>(kPeriodsPerMs) - 20.0;
  }
  return 1e9;
}

}  // namespace

TEST(SelfTestOfTheBridge, AnOrderFromPowerUpOnWaits30MsLongerAndSwitchedOffNotAtAll) {
  EscDraw with = five_inch(3), without = with;
  without.firmware.self_test = false;
  const double with_ms = driven_after_ms(with), without_ms = driven_after_ms(without);
  fmt::print("driven {:.1f} ms after power-up, {:.1f} ms without the self-test\n", with_ms, without_ms);
  EXPECT_LT(without_ms, 13.0);  // 10 ms of zeros, then pulses that ask whether the rotor turns
  EXPECT_GT(with_ms, without_ms + 5.0);
  EXPECT_LT(with_ms, without_ms + 30.0);
}

TEST(SelfTestOfTheBridge, SwitchedOffABrokenBridgeIsDrivenAndTripsUntilItIsGivenUp) {
  for (const bool tested : {true, false}) {
    EscDraw d = five_inch(4);
    d.firmware.self_test = tested;
    sim::NativeEscConfig c = native_config(d);
    c.drive.faults = {{.kind = sim::DriveFaultKind::high_fet_short, .phase = 1}};
    sim::NativeEsc esc(c);
    esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
    esc.set_setpoint(speed(500.0));
    run_ms(esc, 500.0);
    if (tested) {
      EXPECT_EQ(esc.telemetry().trips, 1u);
      EXPECT_EQ(esc.telemetry().blocked, firmware::Blocked::broken);
      EXPECT_EQ(esc.drive().shorted_s(), 0.0);
    } else {
      fmt::print("{} trips, supply shorted for {:.1f} us\n", esc.telemetry().trips, 1e6 * esc.drive().shorted_s());
      EXPECT_GT(esc.telemetry().trips, 4u);
      // By the pulses that look for a rotor that turns: some microseconds each, until the current trips the bridge.
      EXPECT_GT(esc.drive().shorted_s(), esc.telemetry().trips * 2e-6) << "the supply is shorted with every try";
    }
  }
}

TEST(SelfTestOfTheBridge, ARotorThatTurnsAtPowerUpIsCaughtAtOnceAndOneThatComesToRestIsTestedWithinASecond) {
  const EscDraw d = five_inch(5);
  sim::NativeEsc esc(native_config(d));
  esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
  esc.drive().motor().state().omega_rad_s = 700.0;
  esc.set_setpoint(speed(900.0));
  run_ms(esc, 80.0);
  EXPECT_EQ(esc.telemetry().self_test.result, SelfTest::turning);
  EXPECT_EQ(esc.telemetry().state, firmware::MotorState::running);
  sim::NativeEsc coasting(native_config(d));
  coasting.couple_quadratic(d.load_N_m_s2, d.bus_V);
  coasting.drive().motor().state().omega_rad_s = 300.0;
  run_ms(coasting, 100.0);
  EXPECT_EQ(coasting.telemetry().self_test.result, SelfTest::turning);
  coasting.drive().motor().state().omega_rad_s = 0.0;
  run_ms(coasting, 1000.0);
  EXPECT_EQ(coasting.telemetry().self_test.result, SelfTest::passed);
}

TEST(SelfTestOfTheBridge, ASupplyThatComesLateIsWaitedForAndOneThatGoesEndsTheAttempt) {
  const EscDraw d = five_inch(6);
  sim::NativeEsc esc(native_config(d));
  esc.couple_quadratic(d.load_N_m_s2, 5.0);
  run_ms(esc, 50.0);
  EXPECT_EQ(esc.telemetry().self_test.result, SelfTest::due);
  EXPECT_EQ(esc.telemetry().blocked, firmware::Blocked::undervoltage);
  esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
  bool begun = false;
  for (int k = 0; k < 20 * kPeriodsPerMs && !begun; ++k) {
    esc.step_current_loop();
    begun = esc.board().bridge;
  }
  ASSERT_TRUE(begun);
  esc.couple_quadratic(d.load_N_m_s2, 5.0);
  run_ms(esc, 5.0);
  EXPECT_FALSE(esc.board().bridge);
  EXPECT_EQ(esc.telemetry().self_test.result, SelfTest::due);
  esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
  run_ms(esc, 50.0);
  EXPECT_EQ(esc.telemetry().self_test.result, SelfTest::passed);
}

// The interrupt does not come for a millisecond in the midst of a pulse, as while flash is written: the attempt begins anew.
TEST(SelfTestOfTheBridge, SamplesThatWereMissedEndTheAttemptAndTheNextOnePasses) {
  const EscDraw d = five_inch(7);
  sim::NativeEsc esc(native_config(d));
  esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
  int pulses = 0;
  for (int k = 0; k < 60 * kPeriodsPerMs && pulses < 5; ++k) {
    esc.step_current_loop();
    pulses += esc.board().bridge ? 1 : 0;
  }
  esc.set_interrupt([](sim::NativeEsc::Board& board) {
    board.bridge_off();
    return true;
  });
  run_ms(esc, 1.0);
  esc.set_interrupt({});
  EXPECT_EQ(esc.telemetry().self_test.result, SelfTest::due);
  run_ms(esc, 60.0);
  EXPECT_EQ(esc.telemetry().self_test.result, SelfTest::passed);
}
