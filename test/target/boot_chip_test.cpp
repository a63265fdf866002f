// The linked bootloader on the emulated chip: starts, failures, an update by the tool's own code, refusals, power cuts.
#include "test/target/boot_chip.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>

#include "firmware/boot/bootloader.hpp"
#include "test/target/boot_programs.hpp"

namespace rotorloop::boot_chip {
namespace {

using firmware::BootReason;
using tools::UpdatePhase;
constexpr std::int64_t kMs = 1'000'000, kSecond = 1000 * kMs;

class Bench {
 public:
  explicit Bench(std::vector<sim::BusFault> faults = {}, std::uint64_t seed = 1) : bus(boot_elf, std::move(faults), seed), tool(bus) {
    tool.on<protocols::LogMessage>([this](const protocols::LogMessage& m, std::uint8_t) {
      said.emplace_back(m.text.items.begin(), m.text.items.begin() + m.text.count);
    });
  }
  void power_up() {
    bus.end = End::at_cycle;
    bus.chip.power_up(0xA5);
    bus.board.press(false);
  }
  bool heard(const std::string& text) const { return std::find(said.begin(), said.end(), text) != said.end(); }
  std::uint16_t vendor_status() const {
    const auto seen = tool.nodes().find(kNode);
    return seen == tool.nodes().end() ? std::uint16_t{0} : seen->second.status.vendor_status;
  }
  BootChip bus;
  tools::ToolNode tool;
  std::vector<std::string> said;
};

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

// Every case: an update that loses power at an operation of its flash; power again; then the old image runs, the new one runs, or the node
// is on the bus. Where the new one is not there yet, the tool asks again and it installs.
void cut_and_recover(std::uint32_t operation, TornWord leaves, std::array<int, 3>& ends) {
  const auto old = image_of(lives(), 1000), wanted = image_of(lives(), 3000);
  Bench c;
  c.bus.install(old);
  c.bus.write_job();
  tools::FirmwareUpdates updates(c.tool, wanted);
  c.power_up();
  c.bus.chip.blocks().flash.cut_power_at(operation, leaves);
  c.tool.run_until(3 * kSecond, [&] { return c.bus.end != End::at_cycle; });
  ASSERT_EQ(c.bus.end, End::stopped) << "operation " << operation << " never came";
  c.power_up();
  c.tool.run_for(90 * kMs);  // in the window
  ASSERT_EQ(c.bus.end, End::at_cycle);
  ASSERT_EQ(c.tool.nodes().count(kNode), 1u) << "it is on the bus";
  const std::uint16_t status = c.vendor_status();
  ++ends[c.bus.holds(wanted) ? 1 : status == firmware::kWaiting ? 0 : 2];
  ASSERT_TRUE(status != firmware::kWaiting || c.bus.holds(old) || c.bus.holds(wanted)) << "half an image would be started";
  updates.start(kNode);
  ASSERT_TRUE(c.tool.run_until(c.bus.now_ns() + 10 * kSecond, [&] { return updates.step(), c.bus.in_application(); }));
  ASSERT_TRUE(c.bus.holds(wanted));
}

constexpr std::array kKinds{TornWord::untouched, TornWord::all_ones, TornWord::single_error, TornWord::double_error};

std::uint32_t operations_of_an_update() {
  Bench c;
  c.bus.install(image_of(lives(), 1000));
  c.bus.write_job();
  const auto wanted = image_of(lives(), 3000);
  const tools::FirmwareUpdates updates(c.tool, wanted);
  c.power_up();
  auto& flash = c.bus.chip.blocks().flash;
  std::uint32_t most = 0;
  flash.cut_power_at(1u << 30, TornWord::untouched);
  EXPECT_TRUE(c.tool.run_until(3 * kSecond, [&] { return c.bus.in_application(); }));
  most = flash.operations();
  return most;
}

TEST(BootCutOnChip, PowerCutsAtFixedOperationsOfAnUpdateEndWithTheNewImage) {
  const char* by_script = std::getenv("ROTORLOOP_BOOT_CUTS");  // how many
  const auto cases = static_cast<std::uint32_t>(by_script != nullptr ? std::atoi(by_script) : 24);
  const std::uint32_t operations = operations_of_an_update();
  ASSERT_GT(operations, 400u);
  std::array<int, 3> ends{};
  for (std::uint32_t n = 0; n < cases; ++n) {
    // The first and the last ones, which are the record and the release of the first word, and others at equal distances.
    const std::uint32_t k = n < 8 ? n + 1 : n < 16 ? operations - (n - 8) : 9 + (n - 16) * (operations - 18) / (cases - 16);
    SCOPED_TRACE(testing::Message() << "operation " << k << ", kind " << n % 4);
    cut_and_recover(k, kKinds[n % 4], ends);
    if (HasFailure()) return;
  }
  std::printf("%u cuts among %u operations: old image %d, new image %d, waiting %d\n", cases, operations, ends[0], ends[1], ends[2]);
}

}  // namespace
}  // namespace rotorloop::boot_chip

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc != 3) return std::fprintf(stderr, "usage: boot_chip_test BOOTLOADER_ELF APPLICATION_ELF\n"), 2;
  rotorloop::boot_chip::boot_elf = argv[1];
  rotorloop::boot_chip::application_elf = argv[2];
  if (!std::filesystem::exists(argv[1]) || !std::filesystem::exists(argv[2])) {
    std::printf("skipped: 10 tests; the programs were not built\n");
    return 77;
  }
  return RUN_ALL_TESTS();
}
