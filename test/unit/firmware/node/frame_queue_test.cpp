// The transmit queue: arbitration order, age order within an identifier, no overwriting.
#include "firmware/core/node/frame_queue.hpp"

#include <gtest/gtest.h>

namespace rotorloop::firmware {
namespace {

CanFrame frame(std::uint32_t id, bool extended, std::uint8_t mark) { return {.id = id, .extended = extended, .length = 1, .data = {mark}}; }

TEST(FrameQueue, LeavesInArbitrationOrderAndOldestFirstWithinAnIdentifier) {
  FrameQueue<8> q;
  q.push(frame(0x10040A2A, true, 1));
  q.push(frame(0x142, false, 2));
  q.push(frame(0x10040A2A, true, 3));
  q.push(frame(0x1401552A, true, 4));
  q.push(frame(0x10040A2A, true, 5));
  std::string order;
  while (const auto f = q.pop()) order += std::to_string(f->data[0]);
  EXPECT_EQ(order, "21354");
}

TEST(FrameQueue, FullQueueRefusesAndKeepsWhatItHas) {
  FrameQueue<2> q;
  EXPECT_TRUE(q.push(frame(1, false, 1)));
  EXPECT_TRUE(q.push(frame(2, false, 2)));
  EXPECT_FALSE(q.push(frame(0, false, 3)));
  EXPECT_EQ(q.room(), 0u);
  EXPECT_EQ(q.pop()->data[0], 1);
}

TEST(FrameQueue, ReplaceTouchesOnlyTheSameIdentifierOfTheSameFormat) {
  FrameQueue<4> q;
  q.push(frame(0x142, true, 1));
  EXPECT_FALSE(q.replace(frame(0x142, false, 2)));
  EXPECT_TRUE(q.replace(frame(0x142, true, 3)));
  EXPECT_EQ(q.pop()->data[0], 3);
}

}  // namespace
}  // namespace rotorloop::firmware
