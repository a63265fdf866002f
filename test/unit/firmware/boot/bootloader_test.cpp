// What runs after a reset: the decision, the node that waits, and the power cut at every operation of the flash.
#include "firmware/boot/bootloader.hpp"

#include <gtest/gtest.h>

#include "test/unit/firmware/boot/boot_rig.hpp"

namespace rotorloop::firmware {
namespace {

using protocols::LogMessage;
using protocols::NodeMode;
using protocols::NodeStatus;

std::vector<std::uint8_t> old_image() { return bootable({.size = 3000, .seed = 200}); }
std::vector<std::uint8_t> new_image() { return bootable({.size = 4000, .seed = 9}); }

std::uint16_t waiting(BootReason reason) { return static_cast<std::uint16_t>(kWaiting + static_cast<unsigned>(reason)); }

TEST(Boot, WholeApplicationIsStartedAtOnceAfterAResetAndAfterAWindowOf100msAfterPowerUp) {
  for (const ResetCause cause : {ResetCause::software, ResetCause::watchdog, ResetCause::power_on, ResetCause::pin}) {
    BootRig rig;
    rig.install(old_image());
    rig.reset(cause);
    rig.run(1.0);
    ASSERT_TRUE(rig.started);
    const auto took_ms = static_cast<double>(rig.now_us - rig.began_us) * 1e-3;
    const bool window = cause == ResetCause::power_on || cause == ResetCause::pin;
    EXPECT_NEAR(took_ms, window ? 100.0 : 0.5, window ? 1.0 : 0.5);
  }
}

TEST(Boot, UpdateBegunInTheWindowAfterPowerUpIsTakenThoughAnApplicationIsThere) {
  BootRig rig;
  rig.install(old_image());
  rig.server.file = new_image();
  rig.reset(ResetCause::power_on);
  rig.run(0.05);
  ASSERT_FALSE(rig.started);
  rig.begin_update();
  rig.run(10.0);
  EXPECT_TRUE(rig.started);
  EXPECT_EQ(rig.area_bytes(4512), new_image());
}

TEST(Boot, WithoutAnApplicationItWaitsInModeSoftwareUpdateUnderTheStoredIdAndSaysWhyEvery10s) {
  BootRig rig;
  rig.reset(ResetCause::software);
  rig.run(25.0);
  EXPECT_FALSE(rig.started);
  const auto statuses = rig.said<NodeStatus>();
  ASSERT_GE(statuses.size(), 49u) << "each half a second";
  EXPECT_EQ(statuses.back().mode, NodeMode::software_update);
  EXPECT_EQ(statuses.back().health, protocols::Health::error);
  EXPECT_EQ(statuses.back().vendor_status, waiting(BootReason::no_application));
  EXPECT_EQ(rig.logs(), std::vector<std::string>(3, boot_reason_text(BootReason::no_application)));
}

TEST(Boot, EveryByteOfHeaderAndPayloadThatIsAnotherKeepsTheApplicationFromBeingStartedAndTheReasonIsOnTheBus) {
  const auto image = bootable({.size = 40, .seed = 200});
  for (std::size_t at = 0; at < image.size(); ++at) {
    if (at >= kImageFieldBytes && at < kImageHeaderBytes) continue;  // signature and filling
    auto damaged = image;
    damaged[at] ^= 0x10;
    BootRig rig;
    rig.install(damaged);
    rig.reset(ResetCause::software);
    rig.run(0.01);
    ASSERT_FALSE(rig.started) << at;
    const BootReason why = at < 4 ? BootReason::no_application : BootReason::damaged_application;
    ASSERT_EQ(rig.said<NodeStatus>().at(0).vendor_status, waiting(why)) << at;
    ASSERT_TRUE(rig.said_text(boot_reason_text(why)));
  }
}

TEST(Boot, ApplicationWhoseStackPointerOrEntryIsNoAddressOfTheChipIsNotStarted) {
  for (const auto& [stack, entry] : {std::pair{0u, kEntry},
                                     {0xFFFFFFFFu, kEntry},
                                     {0x20000000u, kEntry},
                                     {0x20008004u, kEntry},
                                     {0x20008008u, kEntry},
                                     {0x20002004u, kEntry},
                                     {kStackTop, kEntry - 1},
                                     {kStackTop, 0x080061FFu},
                                     {kStackTop, 0x08006200u + 3001u},
                                     {kStackTop, 0u}}) {
    BootRig rig;
    rig.install(bootable({.size = 3000}, stack, entry));
    rig.reset(ResetCause::software);
    rig.run(0.01);
    EXPECT_FALSE(rig.started) << std::hex << stack << ' ' << entry;
    EXPECT_TRUE(rig.said_text(boot_reason_text(BootReason::wrong_vectors)));
  }
  BootRig ends;  // of the RAM and of the payload
  ends.install(bootable({.size = 3000}, 0x20008000u, 0x08006200u + 2999u));
  ends.reset(ResetCause::software);
  ends.run(0.01);
  EXPECT_TRUE(ends.started);
}

TEST(Boot, ButtonHeldAtPowerUpKeepsItThereAndHeldAtAnyOtherResetDoesNot) {
  for (const ResetCause cause : {ResetCause::power_on, ResetCause::software, ResetCause::watchdog}) {
    BootRig rig;
    rig.install(old_image());
    rig.config.button = true;
    rig.reset(cause);
    rig.run(1.0);
    EXPECT_EQ(rig.started, cause != ResetCause::power_on);
    EXPECT_EQ(rig.said_text(boot_reason_text(BootReason::button)), cause == ResetCause::power_on);
  }
}

TEST(Boot, ThreeResetsByWatchdogOrFaultOfAnApplicationThatNeverWasHealthyKeepItInTheBootloader) {
  BootRig rig;
  rig.install(old_image());
  rig.reset(ResetCause::power_on);
  rig.run(1.0);
  for (int failure = 1; failure <= 3; ++failure) {
    ASSERT_TRUE(rig.started) << failure;
    rig.reset(failure == 2 ? ResetCause::software : ResetCause::watchdog);  // a fault resets by software
    rig.run(1.0);
  }
  EXPECT_FALSE(rig.started);
  EXPECT_TRUE(rig.said_text(boot_reason_text(BootReason::failing_application)));
  rig.reset(ResetCause::watchdog);  // of the bootloader itself: no way back into the loop
  rig.run(1.0);
  EXPECT_FALSE(rig.started);
  rig.server.file = new_image();
  rig.begin_update();
  rig.run(10.0);
  EXPECT_TRUE(rig.started) << "a good image is started at once";
  EXPECT_EQ(rig.area_bytes(4512), new_image());
}

TEST(Boot, FailuresDoNotAddUpOverHealthyRunsOrderedRestartsAndPowerUps) {
  for (const BootStage stage : {BootStage::healthy, BootStage::restart}) {
    BootRig rig;
    rig.install(old_image());
    rig.reset(ResetCause::power_on);
    rig.run(1.0);
    for (int n = 0; n < 6; ++n) {
      ASSERT_TRUE(rig.started) << n;
      if (n % 3 == 2) rig.ram.stage = stage;
      rig.reset(ResetCause::software);
      rig.run(1.0);
    }
    EXPECT_TRUE(rig.started);
  }
  BootRig rig;
  rig.install(old_image());
  rig.ram = {.stage = BootStage::started, .failures = 3};
  rig.reset(ResetCause::power_on);
  rig.run(1.0);
  EXPECT_TRUE(rig.started) << "tried again after a power-up";
}

TEST(Boot, WhatRamHoldsAfterAPowerUpIsNotTakenForAMessage) {
  for (const std::uint32_t word : {0u, ~0u, 0xA5A5A5A5u, Handover{.stage = BootStage::started}.word()}) {
    EXPECT_EQ(Handover::of(word, word).stage, BootStage::none);
    EXPECT_EQ(Handover::of(word ^ 0x01000000u, ~word).stage, BootStage::none);
  }
  const Handover h{.stage = BootStage::healthy, .failures = 2, .cause = ResetCause::pin};
  const Handover back = Handover::of(h.word(), ~h.word());
  EXPECT_EQ(back.stage, h.stage);
  EXPECT_EQ(back.failures, h.failures);
  EXPECT_EQ(back.cause, h.cause);
}

CanFrame allocation(std::span<const std::uint8_t> unique_id, std::uint8_t node) {
  protocols::Allocation a{.node_id = node, .first_part = false, .unique_id = {}};
  for (const std::uint8_t b : unique_id) a.unique_id.push_back(b);
  std::array<std::uint8_t, protocols::max_bytes<protocols::Allocation>()> payload{};
  const std::size_t size = encode(a, payload);
  EXPECT_LE(size, 7u);
  CanFrame out;
  protocols::encode_transfer(
      {.kind = protocols::TransferKind::message, .priority = 30, .data_type_id = protocols::Allocation::kType.id, .source = kServer},
      protocols::Allocation::kType.crc_seed(), 0, {payload.data(), size}, [&](const CanFrame& f) {
        out = f;
        return true;
      });
  return out;
}

TEST(Boot, WithoutAStoredIdItAsksAnAllocatorWithTheUniqueIdOfTheApplication) {
  BootRig rig;
  rig.config.updater.own_id = 0;
  for (std::size_t i = 0; i < 16; ++i) rig.config.updater.unique_id[i] = static_cast<std::uint8_t>(i + 1);
  rig.reset(ResetCause::power_on);
  rig.run(1.1);
  ASSERT_EQ(rig.sent.size(), 1u);
  EXPECT_EQ(rig.sent[0].id & 0xFFu, 0u) << "anonymous";
  EXPECT_EQ(rig.sent[0].data[0], 1) << "any id, first part";
  EXPECT_TRUE(std::equal(rig.sent[0].data.begin() + 1, rig.sent[0].data.begin() + 7, rig.config.updater.unique_id.begin()));
  rig.hear(allocation(std::span(rig.config.updater.unique_id).first(6), 0));
  rig.run(0.5);
  ASSERT_EQ(rig.sent.size(), 2u);
  EXPECT_TRUE(std::equal(rig.sent[1].data.begin() + 1, rig.sent[1].data.begin() + 7, rig.config.updater.unique_id.begin() + 6));
}

TEST(Boot, SaysInGetNodeInfoWhichImagesItTakesAndAtEveryUpdateToo) {
  BootRig rig;
  rig.server.file = new_image();
  rig.reset(ResetCause::software);
  rig.run(0.1);
  CanFrame ask;
  protocols::encode_transfer({.kind = protocols::TransferKind::request,
                              .priority = 24,
                              .data_type_id = protocols::GetNodeInfo::kType.id,
                              .source = kServer,
                              .destination = kNode},
                             protocols::GetNodeInfo::kType.crc_seed(), 0, {}, [&](const CanFrame& f) {
                               ask = f;
                               return true;
                             });
  rig.hear(ask);
  rig.run(0.1);
  static constexpr std::array kWanted{protocols::subscribe(protocols::TransferKind::response, protocols::GetNodeInfo::kType)};
  protocols::Receiver<1, 380> receiver(kServer, kWanted);
  protocols::GetNodeInfoResponse info;
  for (const CanFrame& f : rig.sent) {
    const auto t = receiver.accept(f, 1);
    ASSERT_TRUE(!t || decode(t->payload, info));
  }
  EXPECT_EQ(std::string(info.name.begin(), info.name.begin() + info.name_length), "org.rotorloop.esc.unsigned_accepted");
  rig.begin_update();
  rig.run(5.0);
  EXPECT_TRUE(rig.started);
  EXPECT_TRUE(rig.said_text("unsigned accepted: this program has no key"));
}

TEST(Boot, NoPageIsErasedWhileTheAnswerToBeginFirmwareUpdateIsDue) {
  BootRig rig;
  rig.server.file = new_image();
  rig.reset(ResetCause::software);
  rig.run(0.7);
  const std::size_t before = rig.sent.size();
  const std::uint64_t operations = rig.flash.operations(), asked_us = rig.now_us;
  rig.begin_update();
  while (rig.sent.size() == before) {
    rig.run(0.0001);
    ASSERT_LT(rig.now_us, asked_us + 5'000) << "it answers within 5 ms";
  }
  EXPECT_EQ(rig.flash.operations(), operations);
}

TEST(Boot, APathOfMoreThan200BytesIsRefusedWithItsLengthAndTheLimitAndOneOf200IsAskedFor) {
  using Response = protocols::BeginFirmwareUpdateResponse;
  BootRig rig;
  rig.server.file = new_image();
  rig.reset(ResetCause::power_on);
  rig.run(0.7);
  const auto answers = [&] { return rig.said<Response>(protocols::TransferKind::response); };
  const std::uint64_t operations = rig.flash.operations();
  for (const std::size_t bytes : {201u, 250u}) {
    rig.begin_update(std::string(bytes, 'p'));
    rig.run(2.0);
    ASSERT_FALSE(answers().empty());
    const Response r = answers().back();
    EXPECT_EQ(r.error, Response::Error::unknown);
    EXPECT_EQ(std::string(r.message.items.begin(), r.message.items.begin() + r.message.count),
              "image_file_remote_path has " + std::to_string(bytes) + " bytes: a path has 200 at most");
    EXPECT_FALSE(rig.boot->updater().has_job());
  }
  EXPECT_EQ(rig.flash.operations(), operations) << "nothing was written";
  rig.begin_update(std::string(200, 'p'));
  rig.run(0.1);
  ASSERT_EQ(answers().size(), 3u);
  EXPECT_EQ(answers().back().error, Response::Error::ok);
  EXPECT_TRUE(rig.boot->updater().has_job());
}

TEST(Boot, ANewServerTakesOverFromOneThatHasBeenSilentFor5sAndNotBefore) {
  BootRig rig;
  rig.hand_over();
  rig.server.answers = false;
  rig.reset(ResetCause::software);
  rig.run(2.0);
  const auto job = [&] { return UpdateRecord(rig.flash, rig.config.updater.layout.record_page).job(); };
  UpdateRecord(rig.flash, rig.config.updater.layout.record_page).begin({.server = 99, .own_id = kNode, .path = "old.bin"});
  rig.reset(ResetCause::software);
  rig.run(2.0);
  rig.begin_update();
  rig.run(1.0);
  EXPECT_EQ(job()->server, 99);
  rig.run(3.0);
  rig.server.answers = true;
  rig.server.file = new_image();
  rig.begin_update();
  rig.run(10.0);
  EXPECT_TRUE(rig.started);
  EXPECT_EQ(rig.area_bytes(4512), new_image());
}

TEST(Boot, FileThatIsShorterThanItsHeaderSaysIsRefusedBeforeAnythingIsErased) {
  BootRig rig;
  rig.install(old_image());
  rig.server.file = new_image();
  rig.server.file.pop_back();
  rig.hand_over();
  rig.reset(ResetCause::software);
  rig.run(5.0);
  EXPECT_TRUE(rig.started);
  EXPECT_TRUE(rig.said_text(image_fault_text(ImageFault::truncated)));
  EXPECT_EQ(rig.area_bytes(3512), old_image());
}

TEST(Boot, FileThatComesDamagedTwiceEndsTheJobAndTheNodeWaitsForABetterOne) {
  BootRig rig;
  rig.install(old_image());
  rig.server.file = new_image();
  rig.server.file[3000] ^= 1;
  rig.hand_over();
  rig.reset(ResetCause::software);
  rig.run(20.0);
  EXPECT_FALSE(rig.started);
  EXPECT_EQ(rig.boot->reason(), BootReason::no_application) << "its first word was never written";
  EXPECT_TRUE(rig.said_text(image_fault_text(ImageFault::damaged)));
  rig.server.file = new_image();
  rig.begin_update();
  rig.run(10.0);
  EXPECT_TRUE(rig.started);
}

// --- power cuts ---

enum class After : std::uint8_t { old_one, new_one, waits, count };
using Ends = std::array<int, static_cast<std::size_t>(After::count)>;

// Power again, and what the node is then.
After after_cut(BootRig& rig) {
  rig.flash.power_on();
  rig.ram = Handover::of(0xA5A5A5A5u, 0xA5A5A5A5u);
  rig.sent.clear();
  rig.reset(ResetCause::power_on);
  rig.run(0.09);  // in the window
  if (rig.boot->updater().has_job() || rig.boot->reason() != BootReason::none) {
    EXPECT_FALSE(rig.said<NodeStatus>().empty()) << "it is on the bus";
    EXPECT_EQ(rig.boot->updater().own_id(), kNode);
    EXPECT_TRUE(rig.boot->updater().has_job() || rig.said_text(boot_reason_text(rig.boot->reason())));
    return After::waits;
  }
  if (rig.area_bytes(4512) == new_image()) return After::new_one;
  EXPECT_EQ(rig.area_bytes(3512), old_image()) << "half an image would be started";
  return After::old_one;
}

void finish_update(BootRig& rig) {
  if (!rig.boot->updater().has_job()) rig.begin_update();
  rig.run(100.0);
  ASSERT_TRUE(rig.started);
  ASSERT_EQ(rig.area_bytes(4512), new_image());
}

void cut(BootRig& rig, std::uint64_t operation, Torn torn) {
  rig.flash.cut_at(rig.flash.operations() + operation, torn);
  rig.hand_over();
  if (!rig.flash.powered()) return;
  rig.reset(ResetCause::software);
  rig.run(60.0);
}

std::uint64_t operations_of_an_update() {
  BootRig rig;
  rig.install(old_image());
  rig.server.file = new_image();
  const std::uint64_t before = rig.flash.operations();
  cut(rig, ~std::uint64_t{0} / 2, Torn::done);
  EXPECT_TRUE(rig.started);
  return rig.flash.operations() - before;
}

constexpr std::array kTorn{Torn::untouched, Torn::half, Torn::unreadable, Torn::done};

TEST(BootCut, PowerCutAtEveryFlashOperationOfAnUpdateLeavesTheOldImageTheNewOneOrANodeOnTheBusAndTheUpdateEndsWell) {
  const std::uint64_t operations = operations_of_an_update();
  EXPECT_GT(operations, 590u);
  Ends ends{};
  for (std::uint64_t k = 0; k < operations; ++k) {
    for (const Torn torn : kTorn) {
      SCOPED_TRACE(testing::Message() << "operation " << k << ", torn " << static_cast<int>(torn));
      BootRig rig;
      rig.install(old_image());
      rig.server.file = new_image();
      cut(rig, k, torn);
      ++ends[static_cast<std::size_t>(after_cut(rig))];
      finish_update(rig);
      if (HasFailure()) return;
    }
  }
  for (const int n : ends) EXPECT_GT(n, 0) << "all three ends were met";
  RecordProperty("power_cuts", static_cast<int>(4 * operations));
}

TEST(BootCut, TwoCutsInARowOn1000RandomPairsEndWell) {
  const std::uint64_t operations = operations_of_an_update();
  const RandomStream random(7, 0xC075);
  for (std::uint64_t n = 0; n < 1000; ++n) {
    SCOPED_TRACE(n);
    BootRig rig;
    rig.install(old_image());
    rig.server.file = new_image();
    cut(rig, random.bits(4 * n) % operations, kTorn[random.bits(4 * n + 1) % 4]);
    const After first = after_cut(rig);
    rig.flash.cut_at(rig.flash.operations() + random.bits(4 * n + 2) % operations, kTorn[random.bits(4 * n + 3) % 4]);
    if (first == After::waits && !rig.boot->updater().has_job()) rig.begin_update();
    rig.run(60.0);
    after_cut(rig);
    finish_update(rig);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace rotorloop::firmware
