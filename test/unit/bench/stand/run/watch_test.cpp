// What ends a run before its plan does, by values and times alone: no bus, no motor.
#include "bench/stand/run/watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/stand/run_folder.hpp"
#include "host/base/constants.hpp"
#include "test/unit/bench/stand/run/virtual_run.hpp"

namespace rotorloop {
namespace {

using modbus::LimitAction;
using stand_run::BusState;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kWatchMs = 1'000'000;

struct Watched {
  modbus::StandSetup setup = test::virtual_setup();
  std::vector<stand_run::Trip> trips;
  stand_run::Watch watch{setup, 6, [this](const stand_run::Trip& t) { trips.push_back(t); }};
  Watched() {
    for (const auto& a : setup.axes) watch.note_sample(a.axis, 0);
  }
  std::vector<std::string> limits() const {
    std::vector<std::string> out;
    for (const auto& t : trips) out.push_back(t.limit);
    return out;
  }
};

protocols::EscStatus turning_at(double omega_rad_s) {
  protocols::EscStatus s;
  s.rpm = static_cast<std::int32_t>(omega_rad_s * kRpm_per_rad_s);
  s.voltage_V = 16.0f;
  s.current_A = 5.0f;
  s.temperature_K = 300.0f;
  return s;
}

TEST(StandWatch, ThrustBeyond12NForItsDebounceOf50msTripsWithSourceValueAndAction) {
  Watched w;
  w.watch.reading(modbus::StandAxis::thrust, 13.0, {13.0, 0.1}, 0);
  EXPECT_TRUE(w.trips.empty());
  w.watch.reading(modbus::StandAxis::thrust, 13.0, {13.0, 0.1}, 50 * kWatchMs);
  ASSERT_THAT(w.limits(), ElementsAre("thrust_N"));
  EXPECT_EQ(w.trips[0].source, "thrust");
  EXPECT_EQ(w.trips[0].value, 13.0);
  EXPECT_EQ(w.trips[0].action, LimitAction::ramp_down);
}

TEST(StandWatch, AnESCThatHasBeenSilentForMoreThan1200msIsCut) {
  Watched w;
  BusState b;
  b.heard_ns = 0;
  for (const auto& a : w.setup.axes) w.watch.note_sample(a.axis, 1200 * kWatchMs);
  w.watch.bus(b, 1200 * kWatchMs);
  EXPECT_TRUE(w.trips.empty());
  w.watch.bus(b, 1201 * kWatchMs);
  ASSERT_THAT(w.limits(), ElementsAre("esc_silent"));
  EXPECT_EQ(w.trips[0].action, LimitAction::cut);
}

TEST(StandWatch, AnotherCommanderASharedIndexAndAnErrorOfTheESCAreCutByName) {
  Watched w;
  BusState b;
  b.foreign_ns = 0;
  b.shares_index = true;
  b.esc_fault = "overheated";
  w.watch.bus(b, 10 * kWatchMs);
  EXPECT_THAT(w.limits(), ElementsAre("foreign_commander", "shared_index", "esc_fault"));
  EXPECT_THAT(w.trips[2].source, HasSubstr("overheated"));
  w.trips.clear();
  BusState foreign;
  foreign.foreign_ns = 0;
  w.watch.bus(foreign, 400 * kWatchMs);
  EXPECT_THAT(w.limits(), ElementsAre("foreign_commander")) << "and is forgotten a second after its last command:";
  w.trips.clear();
  for (const auto& a : w.setup.axes) w.watch.note_sample(a.axis, 1000 * kWatchMs);
  w.watch.bus(foreign, 1000 * kWatchMs);
  EXPECT_TRUE(w.trips.empty());
}

TEST(StandWatch, AReadingOlderThan400msNamesItsAxisAndDevice) {
  Watched w;
  for (const auto& a : w.setup.axes)
    if (a.axis != modbus::StandAxis::torque) w.watch.note_sample(a.axis, 401 * kWatchMs);
  w.watch.bus({}, 400 * kWatchMs);
  EXPECT_TRUE(w.trips.empty());
  w.watch.bus({}, 401 * kWatchMs);
  ASSERT_THAT(w.limits(), ElementsAre("stale_ms"));
  EXPECT_EQ(w.trips[0].source, "torque (cell)");
}

TEST(StandWatch, ARotorNeedNotFollowForFourSecondsAfterZeroAndMustFromItsFirstNearnessOn) {
  Watched slow, lost;
  slow.watch.left_zero(0);
  for (int ms = 0; ms <= 4400; ms += 100) slow.watch.status(turning_at(0.0), 500.0, ms * kWatchMs);
  EXPECT_TRUE(slow.trips.empty()) << "4 s and the debounce of 500 ms";
  slow.watch.status(turning_at(0.0), 500.0, 4700 * kWatchMs);
  EXPECT_THAT(slow.limits(), ElementsAre("tracking_error_rad_s"));
  lost.watch.left_zero(0);
  lost.watch.status(turning_at(490.0), 500.0, 100 * kWatchMs);
  for (int ms = 200; ms <= 600; ms += 100) lost.watch.status(turning_at(100.0), 500.0, ms * kWatchMs);
  EXPECT_TRUE(lost.trips.empty());
  lost.watch.status(turning_at(100.0), 500.0, 700 * kWatchMs);
  EXPECT_THAT(lost.limits(), ElementsAre("tracking_error_rad_s"));
}

TEST(StandWatch, AnIndependentSpeedThatDiffersFor300msOfASteadyHoldNamesThePolePairsThatThereAre) {
  Watched w;
  stand_run::GridRow row{0, std::vector<double>(stand::kColumns, 0.0)};
  row.values[stand::kOmegaColumn] = 700.0;
  row.values[stand::kIndependentColumn] = 600.0;
  for (int i = 0; i < 100; ++i) w.watch.speeds(row, false);
  for (int i = 0; i < 29; ++i) w.watch.speeds(row, true);
  EXPECT_TRUE(w.trips.empty());
  w.watch.speeds(row, true);
  ASSERT_THAT(w.limits(), ElementsAre("pole_pairs"));
  EXPECT_THAT(w.trips[0].source, HasSubstr("7/6: the ESC counts 6 pole pairs, by the independent speed there are 7"));
}

TEST(StandWatch, FilesThatCannotBeWrittenAndARunThatIsTooLongRampDown) {
  Watched w;
  BusState b;
  b.elapsed_s = 901.0;
  b.files_failed = true;
  w.watch.bus(b, 0);
  EXPECT_THAT(w.limits(), ElementsAre("run_time_s", "samples"));
  for (const auto& t : w.trips) EXPECT_EQ(t.action, LimitAction::ramp_down);
}

}  // namespace
}  // namespace rotorloop
