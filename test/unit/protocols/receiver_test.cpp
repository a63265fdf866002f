// Reassembly: each rule of the transport with the counter it moves.
#include "protocols/receiver.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "protocols/types.hpp"

namespace rotorloop::protocols {
namespace {

constexpr std::uint8_t kOwn = 10, kPeer = 20;
constexpr std::array<Subscription, 4> kSubscriptions{
    subscribe(TransferKind::message, RawCommand::kType), subscribe(TransferKind::message, EscStatus::kType),
    subscribe(TransferKind::request, GetNodeInfo::kType), subscribe(TransferKind::response, GetNodeInfo::kType)};

std::vector<CanFrame> transfer(const DataType& type, std::uint8_t transfer_id, std::size_t size, std::uint8_t source = kPeer,
                               std::uint8_t fill = 1) {
  std::vector<std::uint8_t> payload(size);
  for (std::size_t i = 0; i < size; ++i) payload[i] = static_cast<std::uint8_t>(fill + i);
  std::vector<CanFrame> frames;
  encode_transfer({.kind = TransferKind::message, .priority = 16, .data_type_id = type.id, .source = source}, type.crc_seed(), transfer_id,
                  payload, [&](const CanFrame& f) {
                    frames.push_back(f);
                    return true;
                  });
  return frames;
}

class Reassembly : public ::testing::Test {
 protected:
  // Number of transfers delivered.
  int feed(const std::vector<CanFrame>& frames, std::uint64_t now_us = 1000) {
    int delivered = 0;
    for (const CanFrame& f : frames) {
      if (const auto t = receiver_.accept(f, now_us)) {
        ++delivered;
        last_.assign(t->payload.begin(), t->payload.end());
      }
    }
    return delivered;
  }
  Receiver<3, 45> receiver_{kOwn, kSubscriptions};
  std::vector<std::uint8_t> last_;
};

TEST_F(Reassembly, TransfersOfEveryLengthComeBackWhole) {
  std::uint8_t id = 0;
  for (std::size_t n = 0; n <= 45; ++n) {
    ASSERT_EQ(feed(transfer(EscStatus::kType, id, n)), 1) << n;
    ASSERT_EQ(last_.size(), n);
    for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(last_[i], i + 1);
    id = static_cast<std::uint8_t>((id + 1) % 32);
  }
  EXPECT_EQ(receiver_.counters().transfers, 46u);
}

TEST_F(Reassembly, InterleavedSendersDoNotDisturbEachOther) {
  const auto a = transfer(EscStatus::kType, 5, 14, 20, 1), b = transfer(EscStatus::kType, 9, 14, 21, 100);
  EXPECT_EQ(feed({a[0], b[0], b[1], a[1], a[2]}), 1);
  EXPECT_EQ(last_[0], 1);
  EXPECT_EQ(feed({b[2]}), 1);
  EXPECT_EQ(last_[0], 100);
}

TEST_F(Reassembly, RepeatedMiddleFrameIsDroppedAndTheTransferSurvives) {
  const auto f = transfer(EscStatus::kType, 5, 14);
  EXPECT_EQ(feed({f[0], f[1], f[1], f[2]}), 1);
  EXPECT_EQ(receiver_.counters().wrong_toggle, 1u);
}

TEST_F(Reassembly, RepeatedFirstFrameIsDroppedAndTheTransferSurvives) {
  const auto f = transfer(EscStatus::kType, 5, 20);
  EXPECT_EQ(feed({f[0], f[0], f[1], f[0], f[2], f[3]}), 1);
  EXPECT_EQ(receiver_.counters().wrong_toggle, 2u);
}

TEST_F(Reassembly, RepeatedTransferIsDeliveredOnce) {
  EXPECT_EQ(feed(transfer(RawCommand::kType, 5, 7)), 1);
  EXPECT_EQ(feed(transfer(RawCommand::kType, 5, 7)), 0);
  EXPECT_EQ(receiver_.counters().duplicate, 1u);
  EXPECT_EQ(feed(transfer(RawCommand::kType, 6, 7)), 1);
}

TEST_F(Reassembly, RepeatedTransferIsNewAgainAfterTwoSeconds) {
  EXPECT_EQ(feed(transfer(RawCommand::kType, 5, 7), 1000), 1);
  EXPECT_EQ(feed(transfer(RawCommand::kType, 5, 7), 1000 + 2'000'000), 0);
  EXPECT_EQ(feed(transfer(RawCommand::kType, 5, 7), 1000 + 2'000'001), 1);
}

TEST_F(Reassembly, LostLastFrameCostsOneTransferOnly) {
  const auto f = transfer(EscStatus::kType, 5, 14);
  EXPECT_EQ(feed({f[0], f[1]}), 0);
  EXPECT_EQ(feed(transfer(EscStatus::kType, 6, 14)), 1);
  EXPECT_EQ(receiver_.counters().aborted, 1u);
}

TEST_F(Reassembly, LostMiddleFrameNeverDeliversWrongBytes) {
  const auto f = transfer(EscStatus::kType, 5, 28);
  EXPECT_EQ(feed({f[0], f[1], f[3], f[4]}), 0);  // the toggle fits neither
  EXPECT_EQ(feed(transfer(EscStatus::kType, 6, 14)), 1);
}

TEST_F(Reassembly, TwoLostFramesPassTheToggleAndAreCaughtByTheCrc) {
  const auto f = transfer(EscStatus::kType, 5, 33);
  ASSERT_EQ(f.size(), 5u);
  EXPECT_EQ(feed({f[0], f[3], f[4]}), 0);
  EXPECT_EQ(receiver_.counters().wrong_crc, 1u);
}

TEST_F(Reassembly, FramesWithoutTheirStartAreDropped) {
  const auto f = transfer(EscStatus::kType, 5, 14);
  EXPECT_EQ(feed({f[1], f[2]}), 0);
  EXPECT_EQ(receiver_.counters().missed_start, 2u);
}

TEST_F(Reassembly, RestOfATransferOlderThanTwoSecondsIsNotUsed) {
  const auto f = transfer(EscStatus::kType, 5, 14);
  EXPECT_EQ(feed({f[0]}, 0), 0);
  EXPECT_EQ(feed({f[1], f[2]}, 2'000'001), 0);
  EXPECT_EQ(receiver_.counters().aborted, 1u);
  EXPECT_EQ(feed(transfer(EscStatus::kType, 6, 14), 2'100'000), 1);
}

TEST_F(Reassembly, FrameOfAnotherTransferInBetweenIsDropped) {
  const auto a = transfer(EscStatus::kType, 5, 14), b = transfer(EscStatus::kType, 9, 14);
  EXPECT_EQ(feed({a[0], b[1], a[1], a[2]}), 1);
  EXPECT_EQ(receiver_.counters().wrong_transfer_id, 1u);
}

TEST_F(Reassembly, SenderWithAnotherSignatureIsCaughtInMultiFrameTransfers) {
  DataType foreign = EscStatus::kType;
  foreign.signature ^= 1;
  EXPECT_EQ(feed(transfer(foreign, 5, 14)), 0);
  EXPECT_EQ(receiver_.counters().wrong_crc, 1u);
  EXPECT_EQ(feed(transfer(foreign, 6, 7)), 1) << "single frames have no CRC";
}

TEST_F(Reassembly, EveryFlippedPayloadBitOfAMultiFrameTransferIsCaught) {
  std::uint8_t id = 0;
  for (std::size_t frame = 0; frame < 3; ++frame) {
    for (std::size_t bit = 0; bit < 8 * (frame < 2 ? 7u : 2u); ++bit) {
      auto f = transfer(EscStatus::kType, id, 14);
      id = static_cast<std::uint8_t>((id + 1) % 32);
      f[frame].data[bit / 8] = static_cast<std::uint8_t>(f[frame].data[bit / 8] ^ 1u << bit % 8);
      EXPECT_EQ(feed(f), 0) << frame << " " << bit;
    }
  }
}

TEST_F(Reassembly, PayloadBeyondTheBufferIsDroppedWithoutHarm) {
  EXPECT_EQ(feed(transfer(EscStatus::kType, 5, 46)), 0);
  EXPECT_EQ(receiver_.counters().too_long, 1u);
  EXPECT_EQ(feed(transfer(EscStatus::kType, 6, 14)), 1);
}

TEST_F(Reassembly, MemoryIsBoundedAndOldSessionsGiveWay) {
  for (std::uint8_t source = 1; source <= 4; ++source) feed(transfer(RawCommand::kType, 0, 7, source), 1000);
  EXPECT_EQ(receiver_.counters().transfers, 3u);
  EXPECT_EQ(receiver_.counters().no_session, 1u);
  EXPECT_EQ(feed(transfer(RawCommand::kType, 0, 7, 4), 1000 + 2'000'001), 1) << "a silent sender's place is taken";
}

TEST_F(Reassembly, StartWithToggleSetBelongsToAnotherProtocolVersion) {
  CanFrame f = transfer(RawCommand::kType, 5, 7)[0];
  f.data[7] = static_cast<std::uint8_t>(f.data[7] | 0x20);
  EXPECT_EQ(feed({f}), 0);
  EXPECT_EQ(receiver_.counters().bad_start, 1u);
}

TEST_F(Reassembly, FrameWithoutTailOrShortBeforeTheEndIsBad) {
  CanFrame f = transfer(EscStatus::kType, 5, 14)[0];
  f.length = 0;
  CanFrame g = f;
  g.length = 5;
  g.data[4] = 0x85;  // start, not end
  EXPECT_EQ(feed({f, g}), 0);
  EXPECT_EQ(receiver_.counters().bad_frame, 2u);
}

TEST_F(Reassembly, AnonymousAndUnknownAndForeignFramesAreCountedApart) {
  CanFrame anonymous = transfer(RawCommand::kType, 0, 3)[0];
  anonymous.id &= ~127u;
  EXPECT_EQ(feed({anonymous}), 0);
  EXPECT_EQ(receiver_.counters().anonymous, 1u);
  EXPECT_EQ(feed(transfer({.service = false, .id = 20001, .signature = 0}, 0, 3)), 0);
  EXPECT_EQ(receiver_.counters().not_subscribed, 1u);
  CanFrame request;
  request.extended = true;
  request.length = 1;
  request.data[0] = 0xC0;
  request.id = encode_id({.kind = TransferKind::request, .priority = 30, .data_type_id = 1, .source = kPeer, .destination = kOwn + 1});
  EXPECT_EQ(feed({request}), 0);
  EXPECT_EQ(receiver_.counters().not_subscribed, 2u);
  request.id = encode_id({.kind = TransferKind::request, .priority = 30, .data_type_id = 1, .source = kPeer, .destination = kOwn});
  EXPECT_EQ(feed({request}), 1);
  request.id = encode_id({.kind = TransferKind::request, .priority = 30, .data_type_id = 1, .source = kOwn, .destination = kOwn});
  EXPECT_EQ(feed({request}), 0);
  EXPECT_EQ(receiver_.counters().bad_address, 1u);
}

TEST_F(Reassembly, StandardFramesAreNotItsBusiness) {
  CanFrame f = transfer(RawCommand::kType, 0, 7)[0];
  f.extended = false;
  EXPECT_EQ(feed({f}), 0);
  EXPECT_EQ(receiver_.counters().not_subscribed, 0u);
}

TEST_F(Reassembly, RequestAndResponseOfOneServiceAreSeparateStreams) {
  for (const TransferKind kind : {TransferKind::request, TransferKind::response}) {
    CanFrame f;
    f.extended = true;
    f.length = 1;
    f.data[0] = 0xC3;
    f.id = encode_id({.kind = kind, .priority = 30, .data_type_id = 1, .source = kPeer, .destination = kOwn});
    const auto t = receiver_.accept(f, 0);
    ASSERT_TRUE(t);
    EXPECT_EQ(t->id.kind, kind);
    EXPECT_EQ(t->transfer_id, 3);
  }
}

}  // namespace
}  // namespace rotorloop::protocols
