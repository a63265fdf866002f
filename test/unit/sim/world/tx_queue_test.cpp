// The transmit queue of a controller: order by identifier, then age; nothing takes part before it is ready.
#include "sim/world/tx_queue.hpp"

#include <gtest/gtest.h>

#include "sim/world/virtual_time.hpp"
#include "test/unit/sim/world/bus_fixture.hpp"

namespace rotorloop::sim {
namespace {

using test::standard;

TEST(TxQueue, LowerIdFirstAndEqualIdsByAge) {
  TxQueue queue(8);
  queue.push(tx_entry(standard(0x300, {1}), 0));
  queue.push(tx_entry(standard(0x100, {2}), 0));
  queue.push(tx_entry(standard(0x300, {3}), 0));
  queue.push(tx_entry(standard(0x100, {4}), 0));
  queue.admit(0);
  std::vector<int> order;
  for (; queue.best() != nullptr; queue.pop_best()) order.push_back(queue.best()->frame.data[0]);
  EXPECT_EQ(order, (std::vector<int>{2, 4, 1, 3}));
}

TEST(TxQueue, EntryTakesPartFromItsReadyTimeOn) {
  TxQueue queue(4);
  queue.push(tx_entry(standard(0x100), 50));
  EXPECT_EQ(queue.earliest_ns(), 50);
  queue.admit(49);
  EXPECT_EQ(queue.best(), nullptr);
  queue.admit(50);
  EXPECT_NE(queue.best(), nullptr);
}

TEST(TxQueue, FullQueueRefusesAndEveryPlaceComesBack) {
  TxQueue queue(3);
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(queue.push(tx_entry(standard(0x100 + static_cast<std::uint32_t>(i)), round)));
    EXPECT_FALSE(queue.push(tx_entry(standard(0), round)));
    if (round % 2 == 0) {
      queue.admit(round);
      for (int i = 0; i < 3; ++i) queue.pop_best();
    } else {
      EXPECT_EQ(queue.clear(), 3u);
    }
    EXPECT_EQ(queue.size(), 0u);
    EXPECT_EQ(queue.earliest_ns(), kNever_ns);
  }
}

}  // namespace
}  // namespace rotorloop::sim
