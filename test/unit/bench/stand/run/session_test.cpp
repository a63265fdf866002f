// Runs on the virtual stand: firmware core, blade-element rotor and instruments in virtual time, the session of hardware.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bench/stand/evaluate/compare/thrust_comparison.hpp"
#include "bench/stand/evaluate/estimate/stand_estimate.hpp"
#include "bench/stand/run/esc_commissioning.hpp"
#include "bench/stand/run/live_values.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/stand/run/virtual_run.hpp"

namespace rotorloop {
namespace {

using stand_run::RunEnd;
using test::VirtualRun;
using testing::HasSubstr;

stand_run::SequenceOptions three_levels() {
  stand_run::SequenceOptions o;
  o.low_rad_s = 600.0;
  o.high_rad_s = 1000.0;
  o.levels = 3;
  o.hold_s = 0.6;
  o.zero_s = 1.0;
  o.idle_s = 1.0;
  o.repeats = 2;
  return o;
}

std::string text_of(const std::filesystem::path& path) {
  std::stringstream s;
  s << std::ifstream(path).rdbuf();
  return s.str();
}

TEST(StandSession, StaircaseWithoutErrorsMeasuresThrustAndTorqueOfTheRotorWithin1percent) {
  VirtualRun run(test::virtual_setup(), test::without_errors(), {"staircase"}, three_levels(), "staircase");
  run.stand.run(run.session, 120.0);
  ASSERT_EQ(run.session.end(), RunEnd::done);
  ASSERT_EQ(run.session.steps().size(), 9u);  // two zeros, idle twice, five of the stairs
  for (const auto& s : run.session.steps()) {
    EXPECT_TRUE(s.settled) << s.number;
    if (s.wanted_rad_s < 500.0) continue;
    EXPECT_NEAR(s.omega_rad_s / s.wanted_rad_s, 1.0, 0.005);
    const double square = s.omega_rad_s * s.omega_rad_s;
    EXPECT_NEAR(s.thrust_N / square / run.stand.rotor().c_t_N_s2(s.omega_rad_s), 1.0, 0.01);
    EXPECT_NEAR(s.torque_N_m / square / run.stand.rotor().c_q_N_m_s2(s.omega_rad_s), 1.0, 0.01);
  }
  EXPECT_LT(std::abs(run.stand.rotor().omega_rad_s()), 1.0);
  EXPECT_THAT(text_of(run.folder / "events.jsonl"), HasSubstr("\"how\":\"done\""));
  EXPECT_GT(run.esc.parameters.size(), 20u);  // what the run was made with
}

TEST(StandSession, EveryAxisOfTheShippedExampleWithProfilesOfRealDevicesIsRead) {
  const auto shipped = [](const std::string& name) { return std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices" / (name + ".toml"); };
  const auto setup = modbus::read_stand_setup(std::filesystem::path(ROTORLOOP_SOURCE_DIR) / "devices/examples/stand.toml", shipped);
  VirtualRun run(setup, test::without_errors(), {"zero"}, three_levels(), "example");
  run.stand.run(run.session, 120.0);
  EXPECT_EQ(run.session.missing(), "");
  EXPECT_EQ(run.session.end(), RunEnd::done);
}

TEST(StandSession, PolePairsCountedWrongInESCAndStandFileStopTheRunByTheIndependentSpeed) {
  modbus::StandSetup setup = test::virtual_setup();
  auto config = test::without_errors();
  setup.pole_pairs = config.rotor.pole_pairs = 6;
  VirtualRun run(setup, config, {"staircase"}, three_levels(), "poles");
  run.stand.run(run.session, 60.0);
  ASSERT_EQ(run.session.end(), RunEnd::tripped);
  EXPECT_EQ(run.session.trip()->limit, "pole_pairs");
  EXPECT_THAT(run.session.trip()->source, HasSubstr("counts 6 pole pairs, by the independent speed there are 7"));
}

TEST(StandSession, PolePairsOfTheESCThatAreNotThoseOfTheStandFileAreRefusedBeforeArming) {
  auto config = test::without_errors();
  config.rotor.pole_pairs = 6;
  try {
    VirtualRun run(test::virtual_setup(), config, {"zero"}, {}, "refused");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::safety);
    EXPECT_THAT(e.what(), HasSubstr("the stand file says 7 pole pairs, the ESC has 6"));
  }
}

TEST(StandSession, AnInstrumentThatDiesIsNamedWithinItsStaleLimitAndTheMotorIsRampedDown) {
  auto config = test::without_errors();
  config.dies = "cell";
  config.dies_at_s = 9.0;
  VirtualRun run(test::virtual_setup(), config, {"endurance"}, three_levels(), "dead");
  run.stand.run(run.session, 60.0);
  ASSERT_EQ(run.session.end(), RunEnd::tripped);
  EXPECT_EQ(run.session.trip()->limit, "stale_ms");
  EXPECT_THAT(run.session.trip()->source, HasSubstr("cell"));
  EXPECT_LT(1e-9 * static_cast<double>(run.session.trip()->at_ns), 9.0 + 0.25 + 0.01);  // stale_ms of the device is 250
  EXPECT_LT(run.stand.rotor().omega_rad_s(), 300.0);
}

TEST(StandSession, ThrustAboveItsLimitForTheDebounceCutsAndLeavesTwoSecondsOfReadings) {
  modbus::StandSetup setup = test::virtual_setup();
  setup.limits.at("thrust_N") = {1.0, 50.0, modbus::LimitAction::cut};
  VirtualRun run(setup, test::without_errors(), {"staircase"}, three_levels(), "thrust");
  run.stand.run(run.session, 60.0);
  ASSERT_EQ(run.session.end(), RunEnd::tripped);
  EXPECT_EQ(run.session.trip()->limit, "thrust_N");
  EXPECT_GT(run.session.trip()->value, 1.0);
  std::istringstream history(text_of(run.folder / "trip.csv"));
  std::string line;
  std::getline(history, line);
  std::getline(history, line);
  const double first_s = std::stod(line);
  double last_s = first_s;
  while (std::getline(history, line)) last_s = std::stod(line);
  EXPECT_NEAR(last_s - first_s, 2.0, 0.05);
}

TEST(StandSession, ABladeThatLosesAPieceShakesTheMountAndStopsTheRunByItsVibrationLimit) {
  auto config = test::without_errors();
  VirtualRun whole(test::virtual_setup(), config, {"endurance"}, three_levels(), "whole");
  whole.until([&] { return whole.session.elapsed_s() > 15.0; }, 30.0);
  EXPECT_EQ(whole.session.end(), RunEnd::running);
  config.chipped_at_s = 12.0;
  config.chipped_shake = 40.0;
  VirtualRun chipped(test::virtual_setup(), config, {"endurance"}, three_levels(), "chipped");
  chipped.stand.run(chipped.session, 60.0);
  ASSERT_EQ(chipped.session.end(), RunEnd::tripped);
  EXPECT_EQ(chipped.session.trip()->limit, "vibration_m_s2");
  EXPECT_LT(1e-9 * static_cast<double>(chipped.session.trip()->at_ns), 12.0 + 0.1 + 0.05);  // its debounce is 100 ms
  EXPECT_THAT(chipped.session.unwatched(), testing::Not(testing::Contains("vibration_m_s2")));
}

TEST(StandSession, MotorConstantsKVWithin1percentRWithin5ByWhatTheESCMeasuresAtRestAndRBeyond5WithoutIt) {
  auto levels = three_levels();
  levels.levels = 12;
  levels.low_rad_s = 400.0;
  levels.high_rad_s = 1400.0;
  VirtualRun run(test::virtual_setup(), test::without_errors(), {"staircase"}, levels, "motor");
  stand::RunFacts facts;
  facts.winding = stand_run::measure_winding(run.tool, run.table, run.esc, 0);
  ASSERT_TRUE(facts.winding);
  run.stand.run(run.session, 120.0);
  ASSERT_EQ(run.session.end(), RunEnd::done);
  const auto estimate = [&] {
    std::ofstream(run.folder / stand::kFactsFile) << stand::run_toml(stand_run::facts_of(facts, run.esc, run.session));
    return stand::estimate_stand(stand::read_stand_run(run.folder, {}), {});
  };
  const auto with = estimate();
  facts.winding.reset();
  const auto without = estimate();
  ASSERT_TRUE(with.motor && without.motor);
  const auto& truth = run.stand.rotor();
  EXPECT_NEAR(with.motor->speed_constant_rpm_V.value / truth.speed_constant_rpm_V(), 1.0, 0.01);
  EXPECT_NEAR(with.motor->resistance_ohm.value / truth.resistance_ohm(), 1.0, 0.05);
  EXPECT_GT(std::abs(without.motor->resistance_ohm.value / truth.resistance_ohm() - 1.0), 0.05);
  for (const auto* e : {&with, &without}) {
    const auto& k = e->motor->speed_constant_rpm_V;
    EXPECT_NEAR(k.value, truth.speed_constant_rpm_V(), 2.0 * k.u) << "R, measured or not, is in u";
  }
}

stand::Bandwidth bandwidth_by(const std::string& sequence) {
  VirtualRun run(test::virtual_setup(), test::without_errors(), {sequence}, three_levels(), "bandwidth_" + sequence);
  run.stand.run(run.session, 120.0);
  EXPECT_EQ(run.session.end(), RunEnd::done);
  std::ofstream(run.folder / stand::kFactsFile) << stand::run_toml(stand_run::facts_of({}, run.esc, run.session));
  const auto e = stand::estimate_stand(stand::read_stand_run(run.folder, {}), {});
  EXPECT_TRUE(e.faults.empty()) << "no channel can be judged by a run without steady steps: " << e.faults.front();
  return e.dynamics && e.dynamics->bandwidth ? *e.dynamics->bandwidth : stand::Bandwidth{};
}

double phase_deg(const stand::Bandwidth& b, double f_Hz) {
  const auto above = std::lower_bound(b.f_Hz.begin(), b.f_Hz.end(), f_Hz);
  if (above == b.f_Hz.end() || above == b.f_Hz.begin()) return std::nan("");
  const auto i = static_cast<std::size_t>(above - b.f_Hz.begin());
  return b.phase_deg[i - 1] + (b.phase_deg[i] - b.phase_deg[i - 1]) * (f_Hz - b.f_Hz[i - 1]) / (b.f_Hz[i] - b.f_Hz[i - 1]);
}

TEST(StandSession, APseudoRandomSequenceFindsThePhaseOfTheChirpWithin3degreesAndThe90degreesBeyondIts12Hz) {
  const auto chirp = bandwidth_by("chirp"), prbs = bandwidth_by("prbs");
  for (const double f_Hz : {2.0, 5.0, 10.0}) EXPECT_NEAR(phase_deg(prbs, f_Hz), phase_deg(chirp, f_Hz), 3.0) << f_Hz << " Hz";
  EXPECT_TRUE(std::isnan(chirp.minus_90deg_Hz));
  EXPECT_GT(prbs.minus_90deg_Hz, chirp.to_Hz);
  EXPECT_LT(prbs.minus_90deg_Hz, prbs.to_Hz);
}

TEST(StandSession, ACommissioningBeforeTheRunTurnsNothingMeasuresLWithin5percentAndLeavesTheESCItsOwnParameters) {
  VirtualRun run(test::virtual_setup(), test::without_errors(), {"zero"}, three_levels(), "commissioned");
  const auto before = tools::read_parameter(run.tool, run.esc.node, "resistance").value;
  const double begun_s = run.stand.now_s();
  const auto w = stand_run::measure_winding(run.tool, run.table, run.esc, 0);
  ASSERT_TRUE(w);
  EXPECT_LT(run.stand.now_s() - begun_s, 8.0);
  EXPECT_NEAR(w->inductance_d_H, 15e-6, 0.05 * 15e-6);  // vehicles/motors/2306_2300kv.toml
  EXPECT_NEAR(w->inductance_q_H, 18e-6, 0.05 * 18e-6);
  EXPECT_NEAR(w->phase_ohm - w->winding_ohm, 4e-3, 1e-4);  // of the board's switches
  EXPECT_LT(std::abs(run.stand.rotor().omega_rad_s()), 1.0);
  EXPECT_TRUE(tools::same_value(tools::read_parameter(run.tool, run.esc.node, "resistance").value, before));
  EXPECT_EQ(tools::waits_for_restart(run.tool, run.esc.node), "");
  run.stand.run(run.session, 60.0);
  EXPECT_EQ(run.session.end(), RunEnd::done);
}

// c_t of the reference plant as its flights were identified (docs/acceptance/identify_closed_loop.md): 1.803e-6 N s² with u of 0.0025e-6.
stand::PairComparison against_flight(double strut) {
  virtual_stand::VirtualStandConfig c = test::without_errors();
  c.errors = virtual_stand::drawn_errors(5, test::virtual_setup().calibration.full_scale);
  c.errors.sensitivity = {{{1.0, 0.0}, {0.0, 1.0}}};
  c.errors.reading_zero = {};
  c.rotor.thrust_lost = strut;
  stand_run::SequenceOptions levels;
  levels.low_rad_s = 400.0;
  levels.high_rad_s = 1400.0;
  levels.levels = 8;
  levels.hold_s = 1.0;
  levels.zero_s = 2.0;
  levels.idle_s = 2.0;
  VirtualRun run(test::virtual_setup(), c, {"staircase"}, levels, "flight");
  run.stand.run(run.session, 200.0, [&] { run.stand.rotor().set_configuration('B'); });
  EXPECT_EQ(run.session.end(), RunEnd::done);
  std::ofstream(run.folder / stand::kFactsFile) << stand::run_toml(stand_run::facts_of({}, run.esc, run.session));
  stand::EstimateOptions o;
  o.window_rad_s = {{730.0, 1150.0}};
  const auto e = stand::estimate_stand(stand::read_stand_run(run.folder, {}), o);
  std::printf("[ measured ] strut %.0f %%: c_t of the stand %.4g N s^2, u %.2f %%\n", 100 * strut, e.reduced_c_t,
              100 * e.thrust->u / e.thrust->value);
  return stand::compare_pair({"stand", e.reduced_c_t, e.thrust->u / e.thrust->value * e.reduced_c_t}, {"flight", 1.803e-6, 0.0025e-6},
                             0.03);
}

TEST(StandAgainstFlight, AnArmBehindTheRotorThatTakes8percentIsDifferentFromTheIdentifiedFlightAndTheBareStandIsNot) {
  const stand::PairComparison blocked = against_flight(0.08), bare = against_flight(0.0);
  EXPECT_EQ(blocked.verdict, stand::ComparisonVerdict::different);
  EXPECT_LT(blocked.high, -0.03);
  EXPECT_NE(bare.verdict, stand::ComparisonVerdict::different);
}

TEST(StandLive, APageGetsPlaceValuesLimitsAndStepsAndSaysWhenItHasStopped) {
  VirtualRun run(test::virtual_setup(), test::without_errors(), {"staircase"}, three_levels(), "live");
  EXPECT_EQ(stand_run::live_values(run.session)["state"], "waiting for readings");
  run.until([&] { return run.session.steps().size() >= 3; }, 60.0);
  const auto now = stand_run::live_values(run.session);
  EXPECT_EQ(now["state"], "running");
  EXPECT_EQ(now["steps"].size(), run.session.steps().size());
  EXPECT_NEAR(now["thrust_N"].get<double>(), *run.session.newest(modbus::StandAxis::thrust), 1e-12);
  EXPECT_GT(now["planned_s"].get<double>(), now["t_s"].get<double>());
  EXPECT_EQ(now["limits"].size(), run.setup.limits.size());
  for (const auto& limit : now["limits"]) {
    if (limit["name"] != "thrust_N") continue;
    EXPECT_EQ(limit["max"], 12.0);
    EXPECT_LT(std::abs(limit["value"].get<double>()), 12.0);
  }
  run.session.ask_stop("test");
  EXPECT_EQ(stand_run::live_values(run.session)["state"], "stopping");
  run.stand.run(run.session, 30.0);
  EXPECT_EQ(stand_run::live_values(run.session)["state"], "stopped");
}

TEST(StandSession, ALimitWhoseActionIsHoldKeepsTheSpeedDownAndMarksTheSteps) {
  modbus::StandSetup setup = test::virtual_setup();
  setup.limits.at("thrust_N") = {1.2, 20.0, modbus::LimitAction::hold};
  VirtualRun run(setup, test::without_errors(), {"staircase"}, three_levels(), "hold");
  run.stand.run(run.session, 60.0);
  EXPECT_EQ(run.session.end(), RunEnd::done);
  EXPECT_TRUE(std::any_of(run.session.steps().begin(), run.session.steps().end(), [](const auto& s) { return s.limited; }));
}

TEST(StandSession, TheFirstStopRampsDownAndTheSecondDisarmsAtOnce) {
  for (const int times : {1, 2}) {
    VirtualRun run(test::virtual_setup(), test::without_errors(), {"endurance"}, three_levels(), "stop");
    run.until([&] { return run.session.esc_rad_s() > 700.0; }, 30.0);
    ASSERT_GT(run.session.esc_rad_s(), 700.0);
    const double asked_s = run.stand.now_s();
    for (int i = 0; i < times; ++i) run.session.ask_stop("test");
    run.until([] { return false; }, 10.0);
    EXPECT_TRUE(run.session.done());
    EXPECT_EQ(run.session.end(), RunEnd::stopped);
    // 800 rad/s at 2000 rad/s^2, then zeros for 0.3 s; at once: the zeros alone.
    EXPECT_NEAR(run.stand.now_s() - asked_s, times == 1 ? 0.7 : 0.32, 0.05);
  }
}

TEST(StandSession, AnESCWhoseHostIsGoneLetsTheRotorRunOutAfterItsOwnTimeOut) {
  VirtualRun run(test::virtual_setup(), test::without_errors(), {"endurance"}, three_levels(), "killed");
  run.until([&] { return run.session.esc_rad_s() > 790.0; }, 30.0);
  run.until([] { return false; }, 0.5);
  TimedBus& bus = run.stand.bus();
  const double turning = run.stand.rotor().omega_rad_s();
  const auto wait_s = [&](double s) {
    for (const auto end_ns = bus.now_ns() + static_cast<std::int64_t>(1e9 * s); bus.now_ns() < end_ns; bus.wait_until(end_ns))
      while (bus.receive_any()) {
      }
  };
  wait_s(0.235);  // the last order is at most 10 ms old: it still holds
  EXPECT_NEAR(run.stand.rotor().omega_rad_s(), turning, 0.02 * turning);
  wait_s(0.017);  // 250 ms and 2 ms for the bus and the node's poll: the bridge is off, nothing drives the rotor any more
  const double released = run.stand.rotor().omega_rad_s();
  wait_s(0.2);
  EXPECT_LT(run.stand.rotor().omega_rad_s(), 0.85 * released);
  EXPECT_LT(run.stand.rotor().supply_A(), 0.01);
}

}  // namespace
}  // namespace rotorloop
