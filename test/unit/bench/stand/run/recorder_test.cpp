// What a run writes, from readings and reports alone: no bus, no motor.
#include "bench/stand/run/recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "host/base/constants.hpp"
#include "test/unit/bench/stand/run/virtual_run.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop {
namespace {

using modbus::StandAxis;

constexpr std::int64_t kRecordedMs = 1'000'000;

std::vector<std::vector<std::string>> cells_of(const std::filesystem::path& path) {
  std::vector<std::vector<std::string>> out;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    out.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) out.back().push_back(cell);
  }
  return out;
}

// Instruments and ESC that say the same 100 times a second, from `from_ms` to `to_ms`.
struct Recorded {
  test::TempFolder folder;
  modbus::StandSetup setup = test::virtual_setup();
  stand_run::Plan plan;
  stand_run::RunFiles files{folder.path() / "run"};
  std::optional<stand_run::Recorder> recorder;
  Recorded() {
    plan.segments = {{.motion = stand_run::Motion::hold, .omega_rad_s = 800.0, .duration_s = 1.0, .measured = true}};
    plan.segments.push_back(plan.segments[0]);
    plan.segments[1].configuration = 'B';
    recorder.emplace(setup, plan, files, 0);
  }
  void come(int from_ms, int to_ms, double omega_rad_s, double thrust_N) {
    protocols::EscStatus s;
    s.rpm = static_cast<std::int32_t>(std::lround(omega_rad_s * kRpm_per_rad_s));
    s.voltage_V = 16.0f;
    s.temperature_K = 300.0f;
    for (int ms = from_ms; ms <= to_ms; ms += 10) {
      for (const auto& a : setup.axes) recorder->reading({a.axis, a.axis == StandAxis::thrust ? thrust_N : 0.02, ms * kRecordedMs, 1000});
      recorder->status(s, ms * kRecordedMs);
    }
  }
  std::filesystem::path file(const char* name) {
    files.flush(0, true);
    return folder.path() / "run" / name;
  }
};

TEST(StandRecorder, AStepsMeansAreThoseOfItsRowsAndConfigurationBHasNoNumberInTheSamples) {
  Recorded r;
  r.recorder->commanded({0, 800.0, 0, 0, true});
  r.recorder->commanded({500 * kRecordedMs, 800.0, 1, 1, true});
  r.recorder->commanded({1000 * kRecordedMs, 800.0, -1, 0, true});
  r.come(0, 500, 800.0, 1.5);
  r.come(510, 1500, 800.0, 1.3);
  (void)r.recorder->rows(1500 * kRecordedMs, false);
  ASSERT_EQ(r.recorder->steps().size(), 2u);
  const stand_run::StepMeans &a = r.recorder->steps()[0], &b = r.recorder->steps()[1];
  EXPECT_NEAR(a.thrust_N, 1.5, 0.01);
  EXPECT_NEAR(b.thrust_N, 1.3, 0.01);
  EXPECT_NEAR(a.omega_rad_s, 800.0, 0.1);
  EXPECT_EQ(b.configuration, 'B');
  const auto samples = cells_of(r.file("samples.csv"));
  ASSERT_EQ(samples[0][1], "step");
  EXPECT_EQ(samples[10][1], "0");
  EXPECT_EQ(samples[60][1], "");
  EXPECT_EQ(samples[60][2], "1");
  EXPECT_EQ(cells_of(r.file("steps.csv")).size(), 3u);
}

TEST(StandRecorder, AStepWhoseSpeedALimitHeldAndOneThatNeverRestedAreMarked) {
  Recorded r;
  r.recorder->commanded({0, 800.0, 0, 0, false});
  r.come(0, 600, 800.0, 1.5);
  (void)r.recorder->rows(600 * kRecordedMs, true);
  r.recorder->finish_step();
  const auto steps = cells_of(r.file("steps.csv"));
  ASSERT_EQ(steps.size(), 2u);
  EXPECT_THAT(steps[1], testing::IsSupersetOf({"unsettled", "limited"}));
}

TEST(StandRecorder, HalfASecondOfSteadySpeedAndThrustRestsAndAThrustThatChangesBy5percentDoesNot) {
  Recorded steady, changing;
  steady.come(0, 1000, 800.0, 1.5);
  (void)steady.recorder->rows(1000 * kRecordedMs, false);
  EXPECT_TRUE(steady.recorder->rests());
  changing.come(0, 700, 800.0, 1.5);
  changing.come(710, 1000, 800.0, 1.575);
  (void)changing.recorder->rows(1000 * kRecordedMs, false);
  EXPECT_FALSE(changing.recorder->rests());
  steady.recorder->forget_recent();
  EXPECT_FALSE(steady.recorder->rests());
}

TEST(StandRecorder, TheHistoryOfATripIsItsLastTwoSecondsOfReadings) {
  Recorded r;
  r.come(0, 5000, 800.0, 1.5);
  r.recorder->history();
  const auto history = cells_of(r.file("trip.csv"));
  EXPECT_EQ(history[0][2], "channel");
  EXPECT_NEAR(std::stod(history[1][0]), 3.0, 0.011);
  EXPECT_EQ(std::stod(history.back()[0]), 5.0);
}

TEST(StandRecorder, TimesAndEventsCountFromTheBeginningOfTheRunAndAxesWithoutAReadingAreNamed) {
  Recorded r;
  EXPECT_THAT(r.recorder->missing(), testing::Contains("thrust"));
  r.come(0, 100, 0.0, 0.0);
  EXPECT_THAT(r.recorder->missing(), testing::IsEmpty());
  r.recorder->begin(100 * kRecordedMs);
  r.recorder->event("trip", {{"limit", "thrust_N"}}, 350 * kRecordedMs);
  std::ifstream in(r.file("events.jsonl"));
  const auto event = nlohmann::json::parse(in);
  EXPECT_DOUBLE_EQ(event["t_s"].get<double>(), 0.25);
  EXPECT_EQ(event["limit"], "thrust_N");
}

}  // namespace
}  // namespace rotorloop
