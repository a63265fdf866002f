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

TEST_F(Reassembly, MemoryIsBoundedAndTheSenderThatStartedLeastRecentlyGivesWay) {
  for (std::uint8_t source = 1; source <= 4; ++source) feed(transfer(RawCommand::kType, 0, 7, source), 1000u * source);
  EXPECT_EQ(receiver_.counters().transfers, 4u) << "a fourth sender is heard although there are three sessions";
  EXPECT_EQ(receiver_.counters().displaced, 1u);
  EXPECT_EQ(feed(transfer(RawCommand::kType, 0, 7, 4), 5000), 0) << "senders 2, 3 and 4 are known: a repetition is dropped";
  EXPECT_EQ(feed(transfer(RawCommand::kType, 0, 7, 2), 5000), 0);
}

TEST_F(Reassembly, FloodOf126SendersNeitherLocksOutANewcomerNorBreaksTheTransferOfTheSenderThatIsKept) {
  receiver_.keep(77);
  const auto long_one = transfer(EscStatus::kType, 5, 14, 77);
  EXPECT_EQ(feed({long_one[0], long_one[1]}, 1000), 0);
  for (std::uint8_t source = 1; source <= 127; ++source) {
    if (source != 77) {
      EXPECT_EQ(feed(transfer(RawCommand::kType, 0, 7, source), 1000u + source), 1) << int{source};
    }
  }
  EXPECT_EQ(feed({long_one[2]}, 2000), 1) << "the sender that is kept";
  receiver_.keep(kNoNode);
  feed({transfer(EscStatus::kType, 6, 14, 77)[0]}, 3000);
  for (std::uint8_t source = 1; source <= 127; ++source) feed(transfer(RawCommand::kType, 1, 7, source), 3000u + source);
  EXPECT_EQ(feed({transfer(EscStatus::kType, 6, 14, 77)[1], transfer(EscStatus::kType, 6, 14, 77)[2]}, 4000), 0)
      << "without keep() the flood takes its place";
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

TEST_F(Reassembly, AnonymousAllocationRequestsAreDeliveredToWhoAskedForThemAsOftenAsTheyCome) {
  constexpr std::array<Subscription, 1> kAllocation{subscribe_anonymous(Allocation::kType)};
  Receiver<2, 45> receiver(kOwn, kAllocation);
  CanFrame f;
  f.extended = true;
  f.id = encode_id({.kind = TransferKind::message, .priority = 30, .data_type_id = 1, .source = kNoNode, .discriminator = 0x1ABC});
  f.length = 8;
  f.data = {0x01, 1, 2, 3, 4, 5, 6, 0xC0};
  for (int n = 0; n < 2; ++n) {
    const auto t = receiver.accept(f, 1000);
    ASSERT_TRUE(t);
    Allocation a;
    ASSERT_TRUE(decode(t->payload, a));
    EXPECT_TRUE(a.first_part);
    EXPECT_EQ(a.unique_id.count, 6);
    EXPECT_EQ(t->id.discriminator, 0x1ABC);
  }
  f.data[7] = 0x80;  // would be the first of several frames: an anonymous transfer has one
  EXPECT_FALSE(receiver.accept(f, 1000));
}

std::vector<CanFdFrame> fd_transfer(std::uint8_t transfer_id, std::size_t size) {
  std::vector<std::uint8_t> payload(size);
  for (std::size_t k = 0; k < size; ++k) payload[k] = static_cast<std::uint8_t>(k + 1);
  std::vector<CanFdFrame> frames;
  encode_transfer_fd({.kind = TransferKind::message, .priority = 16, .data_type_id = EscStatus::kType.id, .source = kPeer},
                     EscStatus::kType.crc_seed(), transfer_id, payload, [&](const CanFdFrame& f) {
                       frames.push_back(f);
                       return true;
                     });
  return frames;
}

TEST_F(Reassembly, FdTransfersOf0To400BytesComeBackWithZerosUpToALengthThatCanFdHas) {
  Receiver<3, 500> receiver(kOwn, kSubscriptions);
  std::uint8_t id = 0;
  for (std::size_t n = 0; n <= 400; ++n, id = static_cast<std::uint8_t>((id + 1) % 32)) {
    std::size_t delivered = 0;
    const auto frames = fd_transfer(id, n);
    for (const CanFdFrame& f : frames) {
      ASSERT_EQ(f.length, fd_length(f.length)) << n << ": no such length on a bus";
      ASSERT_TRUE(&f == &frames.back() || f.length == 64);
      if (const auto t = receiver.accept(f, 1000)) {
        ++delivered;
        ASSERT_EQ(t->framing, Framing::fd);
        ASSERT_GE(t->payload.size(), n);
        for (std::size_t k = 0; k < t->payload.size(); ++k) ASSERT_EQ(t->payload[k], k < n ? static_cast<std::uint8_t>(k + 1) : 0) << n;
      }
    }
    ASSERT_EQ(delivered, 1u) << n;
    EXPECT_EQ(frames.size(), n <= 63 ? 1u : (n + 2 + 62) / 63) << n;
  }
}

TEST_F(Reassembly, EveryFlippedBitOfAnFdTransferOfTwoFramesIsCaughtItsPaddingIncluded) {
  Receiver<3, 500> receiver(kOwn, kSubscriptions);
  std::uint8_t id = 0;
  const std::size_t last = fd_transfer(0, 70)[1].length - 1u;
  EXPECT_EQ(last, 11u);  // 70 + 2 - 63 = 9 bytes, two zeros, tail
  for (std::size_t bit = 0; bit < 8 * (63 + last); ++bit) {
    auto frames = fd_transfer(id, 70);
    id = static_cast<std::uint8_t>((id + 1) % 32);
    std::uint8_t& byte = bit < 8 * 63 ? frames[0].data[bit / 8] : frames[1].data[bit / 8 - 63];
    byte = static_cast<std::uint8_t>(byte ^ 1u << bit % 8);
    for (const CanFdFrame& f : frames) ASSERT_FALSE(receiver.accept(f, 1000)) << bit;
  }
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
