// The linked bootloader on the emulated chip: starts, failures, an update by the tool's own code, refusals.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "test/target/boot_bench.hpp"
#include "test/target/boot_programs.hpp"

namespace rotorloop::boot_chip {
namespace {

using firmware::BootReason;
using tools::UpdatePhase;

TEST(BootOnChip, ProgramOfThisRepositoryIsOnTheBusWithin800msOfPowerUp) {
  Bench c;
  c.bus.install(application_image());
  c.power_up();
  const bool there = c.tool.run_until(2 * kSecond, [&] { return c.bus.in_application(); });
  ASSERT_TRUE(there);
  const std::int64_t started_ns = c.bus.now_ns();
  EXPECT_LE(started_ns, 800 * kMs);
  std::printf("application started %.1f ms after power-up\n", static_cast<double>(started_ns) * 1e-6);
  EXPECT_EQ(c.bus.chip.resets(), 1u) << "the one by which it is entered";
}

double update_s(Bench& c, const std::vector<std::uint8_t>& image, std::int64_t most_ns) {
  tools::FirmwareUpdates updates(c.tool, image, crc_of(image));
  c.power_up();
  c.tool.run_for(700 * kMs);
  const std::int64_t begun_ns = c.bus.now_ns();
  updates.start(kNode);
  std::int64_t read_ns = begun_ns;
  c.tool.run_until(begun_ns + most_ns, [&] {
    updates.step();
    if (updates.nodes().at(kNode).phase <= UpdatePhase::reading) read_ns = c.bus.now_ns();
    return updates.over() || c.bus.end != End::at_cycle;
  });
  EXPECT_EQ(phase_name(updates.nodes().at(kNode).phase), "done") << updates.nodes().at(kNode).reason;
  EXPECT_TRUE(updates.nodes().at(kNode).verified);
  EXPECT_TRUE(c.bus.holds(image)) << "bit by bit";
  EXPECT_EQ(c.tool.nodes().at(kNode).status.mode, protocols::NodeMode::operational);
  return static_cast<double>(read_ns - begun_ns) * 1e-9;
}

TEST(BootOnChip, ProgramOf90KbArrivesBitExactWithin6sOfAnIdleBusAndRuns) {
  Bench c;
  const auto image = application_image();
  ASSERT_GT(image.size(), 90'000u);
  const double time_s = update_s(c, image, 20 * kSecond);
  EXPECT_LE(time_s, 6.0);
  std::printf("%zu bytes in %.2f s\n", image.size(), time_s);
  EXPECT_EQ(c.bus.chip.refused_count(), 0u);
  EXPECT_EQ(c.bus.board.both_on(), 0u);
}

// By environment: an update at a loss of so many percent of all frames at each receiver, once for each seed.
TEST(BootOnChipByScript, ProgramOf90KbArrivesThoughFramesAreLost) {
  const char *percent = std::getenv("ROTORLOOP_BOOT_LOSS_PERCENT"), *seeds = std::getenv("ROTORLOOP_BOOT_SEEDS");
  if (percent == nullptr) GTEST_SKIP() << "give ROTORLOOP_BOOT_LOSS_PERCENT";
  const double loss_percent = std::atof(percent), limit_s = loss_percent <= 1.0 ? 60.0 : 480.0;
  double slowest_s = 0.0;
  const int count = seeds != nullptr ? std::atoi(seeds) : 10;
  for (int seed = 1; seed <= count; ++seed) {
    Bench c({{.kind = sim::BusFaultKind::lose_received, .probability = loss_percent * 0.01}}, static_cast<std::uint64_t>(seed));
    const double time_s = update_s(c, application_image(), 600 * kSecond);
    slowest_s = std::max(slowest_s, time_s);
    std::printf("%s %% lost, seed %d: %.2f s\n", percent, seed, time_s);
    std::fflush(stdout);
    EXPECT_LE(time_s, limit_s) << "seed " << seed;
  }
  std::printf("%s %% lost, %d seeds: slowest %.2f s\n", percent, count, slowest_s);
}

TEST(BootOnChip, ApplicationThatHangsCrashesOrHasAStackNowhereEndsInTheBootloaderAndAGoodImageInstalls) {
  struct Row {
    std::vector<std::uint8_t> bad;
    BootReason why;
  };
  for (const Row& row :
       {Row{image_of(hangs(), 1000), BootReason::failing_application}, Row{image_of(crashes(), 1000), BootReason::failing_application},
        Row{image_of(lives(), 1000, 0x3000'0000), BootReason::wrong_vectors}}) {
    Bench c;
    c.bus.install(row.bad);
    c.power_up();
    c.bus.chip.ignore_lock_up = true;
    const auto wanted = static_cast<std::uint16_t>(firmware::kWaiting + static_cast<unsigned>(row.why));
    ASSERT_TRUE(c.tool.run_until(2 * kSecond, [&] { return c.vendor_status() == wanted && c.heard(boot_reason_text(row.why)); }))
        << boot_reason_text(row.why);
    const auto good = image_of(lives(), 3000);
    tools::FirmwareUpdates updates(c.tool, good);
    updates.start(kNode);
    EXPECT_TRUE(c.tool.run_until(c.bus.now_ns() + 5 * kSecond, [&] { return updates.step(), c.bus.in_application(); }));
    EXPECT_TRUE(c.bus.holds(good));
  }
}

// Unsigned and with another key too: the bootloader has the test key.
TEST(BootOnChip, ImageThatIsNotForItIsRefusedInWordsAndNotAByteOfTheOldOneChanges) {
  using firmware::ImageFault;
  const auto good = unsigned_image_of(lives(), 3000, 0x2000'2000, 3);
  auto other = good, damaged = test_signed(good), version = damaged, cut_short = damaged;
  firmware::ImageHeader h;
  ASSERT_EQ(firmware::parse_image(good, h), ImageFault::none);
  h.board = firmware::board_name("b_other");
  firmware::write_image_fields(h, other);
  damaged[30] ^= 1;
  version[4] = 9;
  cut_short.pop_back();
  const auto old = image_of(lives(), 1000, 0x2000'2000, 3);
  const std::uint32_t too_large = 48 * kPage - firmware::kImageHeaderBytes + 1;
  for (const auto& [file, says] :
       {std::pair<std::vector<std::uint8_t>, std::string>{test_signed(other), image_fault_text(ImageFault::other_board)},
        {damaged, image_fault_text(ImageFault::header_damaged)},
        {version, image_fault_text(ImageFault::header_version)},
        {cut_short, image_fault_text(ImageFault::truncated)},
        {image_of(lives(), too_large, 0x2000'2000, 3), image_fault_text(ImageFault::too_large)},
        {std::vector<std::uint8_t>(3000, 0x55), image_fault_text(ImageFault::not_an_image)},
        {good, image_fault_text(ImageFault::not_signed)},
        {firmware::Signer(std::vector<std::uint8_t>(32, 0x17)).signed_image(good), image_fault_text(ImageFault::wrong_key)},
        {image_of(lives(), 3000, 0x2000'2000, 2), "image has security version 2, this node wants 3 or more"}}) {
    Bench c;
    c.bus.install(old);
    c.bus.write_job();
    const tools::FirmwareUpdates updates(c.tool, file);
    c.power_up();
    ASSERT_TRUE(c.tool.run_until(3 * kSecond, [&] { return c.bus.in_application(); })) << says;
    EXPECT_TRUE(c.heard(says)) << says;
    EXPECT_TRUE(c.bus.holds(old));
  }
}

std::string name_of(Bench& c) {
  std::string name;
  c.tool.request<protocols::GetNodeInfo, protocols::GetNodeInfoResponse>(kNode, {}, [&](const auto& r) {
    if (r) name.assign(r->name.begin(), r->name.begin() + r->name_length);
  });
  c.run_for(kSecond, [&] { return !name.empty(); });
  return name;
}

// Its key is 32 bytes of 0x17 (firmware_test.py).
TEST(BootOnChip, BootloaderWithAReleaseKeyTakesItsImagesAndRefusesTheTestKeyUnsignedImagesAndAProgramOfTheTestKey) {
  using firmware::ImageFault;
  const firmware::Signer release(std::vector<std::uint8_t>(32, 0x17));
  const auto wanted = unsigned_image_of(lives(), 3000, 0x2000'2000, 0);
  const auto old = unsigned_image_of(lives(), 1000, 0x2000'2000, 0), good_old = release.signed_image(old);
  for (const auto& [file, fault] : {std::pair{test_signed(wanted), ImageFault::wrong_key}, {wanted, ImageFault::not_signed}}) {
    Bench c({}, 1, release_boot_elf);
    c.bus.install(good_old);
    c.bus.write_job();
    const tools::FirmwareUpdates updates(c.tool, file);
    c.power_up();
    ASSERT_TRUE(c.run_for(3 * kSecond, [&] { return c.bus.in_application(); }));
    EXPECT_TRUE(c.heard(image_fault_text(fault)) && c.bus.holds(good_old)) << image_fault_text(fault);
  }
  Bench c({}, 1, release_boot_elf);
  c.bus.install(test_signed(old));
  c.power_up();
  ASSERT_TRUE(c.run_for(kSecond, [&] { return c.heard(boot_reason_text(BootReason::damaged_application)); }));
  EXPECT_EQ(name_of(c), "org.rotorloop.b_g431b_esc1") << "nothing behind it";
  const auto good = release.signed_image(wanted);
  tools::FirmwareUpdates updates(c.tool, good);
  updates.start(kNode);
  EXPECT_TRUE(c.run_for(5 * kSecond, [&] { return updates.step(), c.bus.in_application(); }));
  EXPECT_TRUE(c.bus.holds(good));
}

}  // namespace
}  // namespace rotorloop::boot_chip

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc != 4) return std::fprintf(stderr, "usage: boot_chip_test BOOTLOADER_ELF APPLICATION_ELF BOOTLOADER_OF_A_RELEASE_KEY_ELF\n"), 2;
  rotorloop::boot_chip::boot_elf = argv[1];
  rotorloop::boot_chip::application_elf = argv[2];
  rotorloop::boot_chip::release_boot_elf = argv[3];
  if (!std::all_of(argv + 1, argv + argc, [](const char* file) { return std::filesystem::exists(file); })) {
    std::printf("skipped: 1 program; the programs of the chip were not built\n");
    return 77;
  }
  return RUN_ALL_TESTS();
}
