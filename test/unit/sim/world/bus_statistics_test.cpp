// Load windows with stretches that span them, and the table of identifiers.
#include "sim/world/bus_statistics.hpp"

#include <gtest/gtest.h>

namespace rotorloop::sim {
namespace {

TEST(LoadMeter, StretchThatSpansWindowsIsSharedBetweenThem) {
  LoadMeter load(0, 100, 10);
  load.add_busy(10, 30);    // 20 in window 0
  load.add_busy(90, 310);   // 10, 100, 100, 10
  load.add_busy(350, 360);  // 10 in window 3
  load.advance_to(500);
  const auto windows = load.window_load_percent();
  ASSERT_EQ(windows.size(), 5u);
  const float expected[] = {30.0f, 100.0f, 100.0f, 20.0f, 0.0f};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_FLOAT_EQ(windows[i], expected[i]) << "window " << i;
  EXPECT_DOUBLE_EQ(load.max_load_percent(), 100.0);
}

TEST(LoadMeter, BusyTimeWithinAFrameCountsOnlyWhatHasPassed) {
  LoadMeter load(0, 100, 0);
  load.add_busy(0, 20);
  load.add_busy(50, 90);
  EXPECT_EQ(load.busy_until_ns(50), 20);
  EXPECT_EQ(load.busy_until_ns(70), 40);
  EXPECT_EQ(load.busy_until_ns(90), 60);
  EXPECT_EQ(load.busy_until_ns(1000), 60);
}

TEST(LoadMeter, MaximumGoesOnWhenNoMoreWindowsAreStored) {
  LoadMeter load(0, 100, 1);
  load.add_busy(0, 10);
  load.add_busy(100, 170);
  load.advance_to(200);
  EXPECT_EQ(load.window_load_percent().size(), 1u);
  EXPECT_DOUBLE_EQ(load.max_load_percent(), 70.0);
}

TEST(IdTable, StandardAndExtendedIdsOfEqualNumberAreTwoRowsAndAFullTableSaysSo) {
  IdTable table(8);
  table.find_or_add(5, false)->frames = 1;
  table.find_or_add(5, true)->frames = 2;
  EXPECT_EQ(table.find_or_add(5, false)->frames, 1u);
  for (std::uint32_t id = 100; id < 105; ++id) table.find_or_add(id, false)->frames = 1;
  EXPECT_EQ(table.find_or_add(200, false), nullptr);
  EXPECT_NE(table.find_or_add(104, false), nullptr);
  const auto rows = table.rows();
  ASSERT_EQ(rows.size(), 7u);
  EXPECT_TRUE(rows[0].extended) << "29-bit 5 has leading bits 0: it ranks before 11-bit 5";
}

}  // namespace
}  // namespace rotorloop::sim
