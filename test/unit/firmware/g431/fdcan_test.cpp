// The CAN port over registers: bit timing, what is sent in which order, what is received, filters, bus off.
#include "firmware/board/g431/fdcan.hpp"

#include "test/unit/firmware/g431/chip_fake.hpp"

namespace rotorloop::g431 {
namespace {

class Can : public ChipFake {
 protected:
  Can() { started = can.start(1'000'000); }
  static CanFrame frame(std::uint32_t id, std::uint8_t mark) { return {.id = id, .extended = true, .length = 1, .data = {mark}}; }
  void sent(std::uint32_t buffer) { fdcan().txbrp.hardware(fdcan().txbrp.peek() & ~bit(buffer)); }
  static std::uint32_t mark_in(std::uint32_t buffer) { return fdcan_memory().transmit[buffer].word[2].peek() & 0xFFu; }
  // A frame in FIFO 0 at `index`, as the controller leaves it.
  static void arrives(std::uint32_t index, std::uint32_t head, std::uint32_t control, std::uint32_t low, std::uint32_t high) {
    FdcanElement& e = fdcan_memory().fifo0[index];
    const std::array<std::uint32_t, 4> words{head, control, low, high};
    for (std::size_t i = 0; i < 4; ++i) e.word[i].hardware(words[i]);
    fdcan().rxf0s.hardware(1u | index << 8u);
    fdcan().ir.hardware(fdcan_bits::kNewInFifo0);
  }
  Fdcan can;
  bool started = false;
};

TEST_F(Can, At1MbitABitHas17QuantaOfA10thOfTheClockAndIsSampledAt88Percent) {
  const auto t = can_bit_timing(kCore_Hz, 1'000'000);
  ASSERT_TRUE(t);
  EXPECT_EQ(t->divider, 10u);
  EXPECT_EQ(kCore_Hz / t->divider / t->quanta(), 1'000'000u);
  EXPECT_NEAR(static_cast<double>(1 + t->before) / t->quanta(), 0.882, 0.001);
  EXPECT_EQ(fdcan().nbtp.peek(), 1u << 25 | 9u << 16 | 13u << 8 | 1u);
  for (const std::uint32_t rate : {500'000u, 250'000u, 125'000u}) {
    ASSERT_TRUE(can_bit_timing(kCore_Hz, rate));
    EXPECT_EQ(kCore_Hz / can_bit_timing(kCore_Hz, rate)->divider / 17, rate);
  }
  EXPECT_FALSE(can_bit_timing(kCore_Hz, 800'000));
  EXPECT_FALSE(can_bit_timing(kCore_Hz, 0));
}

TEST_F(Can, StartsOnTheBusWithAnEmptyMessageMemoryAndReceivesIntoFifo0ByInterrupt) {
  ASSERT_TRUE(started);
  EXPECT_EQ(fdcan().cccr.peek() & 3u, 0u);
  EXPECT_EQ(fdcan().ie.peek(), fdcan_bits::kNewInFifo0 | fdcan_bits::kLostInFifo0);
  EXPECT_EQ(fdcan().txbc.peek(), fdcan_bits::kQueueMode);
}

TEST_F(Can, FramesOfOneIdentifierNeverOvertakeEachOther) {
  EXPECT_TRUE(can.send(frame(5, 1)) && can.send(frame(5, 2)) && can.send(frame(5, 3)));
  EXPECT_FALSE(can.ready());
  sent(0);
  EXPECT_FALSE(can.ready()) << "buffer 0 is free, but would leave before 1 and 2";
  EXPECT_FALSE(can.send(frame(5, 4)));
  sent(1);
  EXPECT_FALSE(can.ready());
  sent(2);
  EXPECT_TRUE(can.send(frame(5, 4)));
  EXPECT_EQ(mark_in(0), 4u);
}

TEST_F(Can, StandardAndExtendedFramesArriveAsTheyWereSentAndRemoteOnesDoNot) {
  arrives(2, 0x123u << 18, 3u << 16, 0x00CCBBAAu, 0);
  can.on_interrupt(77);
  arrives(0, bit(30) | 0x1BADCAFEu, 8u << 16, 0x04030201u, 0x08070605u);
  can.on_interrupt(78);
  arrives(1, bit(29) | 0x10u << 18, 0, 0, 0);
  fdcan().rxf0s.hardware(0);
  const auto first = can.receive(), second = can.receive();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->frame, (CanFrame{.id = 0x123, .extended = false, .length = 3, .data = {0xAA, 0xBB, 0xCC}}));
  EXPECT_EQ(first->time_us, 77u);
  EXPECT_EQ(second->frame, (CanFrame{.id = 0x1BADCAFE, .extended = true, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}}));
}

TEST_F(Can, FiltersGoToTheirListsAndAllOthersAreRejectedThen) {
  const std::array<CanFilter, 2> filters{
      {{.id = 0x140, .mask = 0x7F0, .extended = false}, {.id = 0x10040A00, .mask = 0x1FFFFF00, .extended = true}}};
  ASSERT_TRUE(can.set_filters(filters));
  EXPECT_EQ(fdcan_memory().standard_filter[0].peek(), 2u << 30 | 1u << 27 | 0x140u << 16 | 0x7F0u);
  EXPECT_EQ(fdcan_memory().extended_filter[0][0].peek(), 1u << 29 | 0x10040A00u);
  EXPECT_EQ(fdcan_memory().extended_filter[0][1].peek(), 2u << 30 | 0x1FFFFF00u);
  EXPECT_EQ(fdcan().rxgfc.peek(), fdcan_bits::kRejectOthers | fdcan_bits::kRejectRemote | 1u << 16 | 1u << 24);
  EXPECT_EQ(fdcan().cccr.peek() & 3u, 0u) << "back on the bus";
  const std::vector<CanFilter> too_many(9, {.extended = true});
  EXPECT_FALSE(can.set_filters(too_many));
}

TEST_F(Can, BusOffIsLeftOnRequestWithNothingOldToSend) {
  EXPECT_TRUE(can.send(frame(5, 1)));
  fdcan().psr.hardware(fdcan_bits::kBusOff);
  fdcan().cccr.hardware(fdcan_bits::kInit);
  EXPECT_EQ(can.state(), BusState::bus_off);
  EXPECT_FALSE(can.ready());
  can.recover();
  EXPECT_EQ(fdcan().txbcr.peek(), 7u);
  EXPECT_EQ(fdcan().cccr.peek() & fdcan_bits::kInit, 0u);
}

TEST(ReceiveRing, HoldsItsSizeInOrderAndDropsTheNewestAfterThat) {
  ReceiveRing<16> ring;
  for (std::uint32_t i = 0; i < 20; ++i) ring.push({.frame = {.id = i}, .time_us = i});
  EXPECT_EQ(ring.dropped(), 4u);
  for (std::uint32_t i = 0; i < 16; ++i) EXPECT_EQ(ring.pop()->frame.id, i);
  EXPECT_FALSE(ring.pop());
  ring.push({.frame = {.id = 99}});
  EXPECT_EQ(ring.pop()->frame.id, 99u);
}

}  // namespace
}  // namespace rotorloop::g431
