// The transmit queue: arbitration order, age order within an identifier, no overwriting.
#include "firmware/core/node/transmit_queue.hpp"

#include <gtest/gtest.h>

namespace rotorloop::firmware {
namespace {

CanFrame frame(std::uint32_t id, bool extended, std::uint8_t mark) { return {.id = id, .extended = extended, .length = 1, .data = {mark}}; }

TEST(TransmitQueue, LeavesInArbitrationOrderAndOldestFirstWithinAnIdentifier) {
  TransmitQueue<8> q;
  q.push(frame(0x10040A2A, true, 1), 0);
  q.push(frame(0x142, false, 2), 0);
  q.push(frame(0x10040A2A, true, 3), 0);
  q.push(frame(0x1401552A, true, 4), 0);
  q.push(frame(0x10040A2A, true, 5), 0);
  std::string order;
  while (const auto f = q.pop()) order += std::to_string(f->data[0]);
  EXPECT_EQ(order, "21354");
}

TEST(TransmitQueue, FullQueueRefusesAndKeepsWhatItHas) {
  TransmitQueue<2> q;
  EXPECT_TRUE(q.push(frame(1, false, 1), 0));
  EXPECT_TRUE(q.push(frame(2, false, 2), 0));
  EXPECT_FALSE(q.push(frame(0, false, 3), 0));
  EXPECT_EQ(q.room(), 0u);
  EXPECT_EQ(q.pop()->data[0], 1);
}

TEST(TransmitQueue, ReplaceTouchesOnlyTheSameIdentifierOfTheSameFormat) {
  TransmitQueue<4> q;
  q.push(frame(0x142, true, 1), 0);
  EXPECT_FALSE(q.replace(frame(0x142, false, 2), 0));
  EXPECT_TRUE(q.replace(frame(0x142, true, 3), 0));
  EXPECT_EQ(q.pop()->data[0], 3);
}

TEST(TransmitQueue, TransferThatWaitedASecondLeavesWholeAndWhatCameLaterStays) {
  TransmitQueue<8> q;
  for (std::uint8_t k = 0; k < 3; ++k) q.push(frame(0x10040A2A, true, k), 5'000'000);
  q.push(frame(0x1401552A, true, 9), 5'600'000);
  EXPECT_EQ(q.expire(6'000'000), 0u) << "exactly a second: still in time";
  EXPECT_EQ(q.pop()->data[0], 0);
  EXPECT_EQ(q.expire(6'001'000), 2u) << "the rest of the transfer, although its first frame has left";
  EXPECT_EQ(q.size(), 1u);
  EXPECT_EQ(q.pop()->data[0], 9);
}

TEST(TransmitQueue, LifeIsCountedAcrossTheWrapOfTheMillisecondCounter) {
  TransmitQueue<2> q;
  const std::uint64_t wrap_us = (std::uint64_t{1} << 32) * 1000;
  q.push(frame(1, false, 1), wrap_us - 400'000);
  EXPECT_EQ(q.expire(wrap_us + 500'000), 0u);
  EXPECT_EQ(q.expire(wrap_us + 700'000), 1u);
}

}  // namespace
}  // namespace rotorloop::firmware
