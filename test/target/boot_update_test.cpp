// Updates of the bootloader on the emulated chip beside others: four at once, a flight on the same bus, a file that changes while it is
// served, and a hostile bus.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "host/base/random.hpp"
#include "test/target/boot_bench.hpp"
#include "test/target/boot_fleet.hpp"
#include "test/target/boot_programs.hpp"

namespace rotorloop::boot_chip {
namespace {

using namespace protocols;
using tools::UpdatePhase;

// The program of this repository by script, else one of 12 KB, which takes a seventh of the time.
std::vector<std::uint8_t> image_for_the_bus() {
  return std::getenv("ROTORLOOP_BOOT_WHOLE") != nullptr ? application_image() : image_of(lives(), 12'000);
}

// From the question to the last block that the last node reads.
double update_all_s(BootFleet& fleet, int chips, const std::vector<std::uint8_t>& image) {
  tools::ToolNode tool(fleet);
  tools::FirmwareUpdates updates(tool, image, crc_of(image));
  fleet.power_up();
  tool.run_for(400 * kMs);
  const std::int64_t begun_ns = fleet.now_ns();
  for (int i = 0; i < chips; ++i) updates.start(static_cast<std::uint8_t>(kNode + i));
  std::int64_t read_ns = begun_ns;
  const bool all_run = tool.run_until(begun_ns + 60 * kSecond, [&] {
    updates.step();
    int running = 0;
    for (int i = 0; i < chips; ++i) {
      if (updates.nodes().at(static_cast<std::uint8_t>(kNode + i)).phase <= UpdatePhase::reading) read_ns = fleet.now_ns();
      running += fleet.in_application(i) ? 1 : 0;
    }
    return running == chips || fleet.refused();
  });
  EXPECT_TRUE(all_run && !fleet.refused());
  for (int i = 0; i < chips; ++i) EXPECT_TRUE(fleet.holds(i, image)) << "chip " << i << ", bit by bit";
  return static_cast<double>(read_ns - begun_ns) * 1e-9;
}

TEST(BootBesideOthers, FourChipsAtOnceTakeNoMoreThanThreeTimesOne) {
  const auto image = image_for_the_bus();
  BootFleet alone(boot_elf, 1), four(boot_elf, 4);
  const double one_s = update_all_s(alone, 1, image), four_s = update_all_s(four, 4, image);
  EXPECT_LE(four_s, 3.0 * one_s);
  std::printf("%zu bytes: one chip %.2f s, four at once %.2f s\n", image.size(), one_s, four_s);
}

TEST(BootBesideOthers, AFlightOfThreeOtherEscsOnTheSameBusLosesNoSetPointAndNoFeedback) {
  const auto image = image_for_the_bus();
  BootFleet fleet(boot_elf, 1);
  OtherFlight flight(fleet.bus);
  fleet.each_ms = [&](std::int64_t now_ns) { flight.each_ms(now_ns); };
  const double time_s = update_all_s(fleet, 1, image);
  EXPECT_LE(time_s, 12.0);
  EXPECT_EQ(flight.set_points, 3 * (flight.sent - 1)) << "of the last millisecond none was looked at";
  EXPECT_EQ(flight.feedback, 3 * (flight.sent - 1));
  EXPECT_LT(flight.latest_ns, kMs);
  std::printf("%zu bytes beside 1 kHz: %.2f s; %llu ms of flight, nothing lost, latest frame after %.0f us\n", image.size(), time_s,
              static_cast<unsigned long long>(flight.sent), static_cast<double>(flight.latest_ns) * 1e-3);
}

// Serves `first` until a block, then the other file. The mixture is refused in words; asked again, the node has the second one whole.
TEST(BootBesideOthers, AFileThatChangesWhileItIsServedIsSaidToBeDamagedAndNeverStarted) {
  auto code = lives();
  const auto old = image_of(code, 1000), first = image_of(code, 3000);
  code.resize(1200, 0xBF00);
  const auto second = image_of(code, 3000);
  for (const std::uint64_t changes_at_B : {256u, 1024u, 3328u}) {
    SCOPED_TRACE(testing::Message() << "changes at byte " << changes_at_B);
    BootFleet fleet(boot_elf, 1);
    std::copy(old.begin(), old.end(), fleet.chip(0).memory(kArea, 1));
    write_job(fleet.chip(0));
    tools::ToolNode tool(fleet);
    bool changed = false;
    std::vector<std::string> said;
    tool.on<LogMessage>(
        [&](const LogMessage& m, std::uint8_t) { said.emplace_back(m.text.items.begin(), m.text.items.begin() + m.text.count); });
    tool.serve<FileGetInfo, FileGetInfoResponse>([&](const FileGetInfo&, std::uint8_t) {
      FileGetInfoResponse r;
      r.size = first.size();
      return std::optional(r);
    });
    tool.serve<FileRead, FileReadResponse>([&](const FileRead& q, std::uint8_t) {
      changed = changed || q.offset >= changes_at_B;
      const auto& file = changed ? second : first;
      const std::uint64_t begin = std::min<std::uint64_t>(q.offset, file.size());
      FileReadResponse r;
      r.data.assign({file.data() + begin, static_cast<std::size_t>(std::min<std::uint64_t>(FileRead::kBlock, file.size() - begin))});
      return std::optional(r);
    });
    const auto complained = [&] {
      return std::any_of(said.begin(), said.end(), [](const std::string& text) {
        return text == image_fault_text(firmware::ImageFault::damaged) || text == image_fault_text(firmware::ImageFault::wrong_key);
      });
    };
    fleet.power_up();
    ASSERT_TRUE(tool.run_until(5 * kSecond, [&] { return fleet.in_application(0) || complained(); }));
    EXPECT_TRUE(complained() && !fleet.in_application(0));
    BeginFirmwareUpdate q;
    q.path = FilePath("fw");
    tool.request<BeginFirmwareUpdate, BeginFirmwareUpdateResponse>(kNode, q, [](const auto&) {});
    EXPECT_TRUE(tool.run_until(15 * kSecond, [&] { return fleet.in_application(0); }));
    EXPECT_TRUE(fleet.holds(0, second));
  }
}

// Whatever a node without manners can send: floods, blocks with our transfer ids from a foreign node and from one that takes the server's
// id, another server's job, a node with the id of the one that is updated.
class Enemy {
 public:
  Enemy(sim::VirtualBus& bus, std::uint64_t seed)
      : port_(bus.attach({.name = "enemy", .tx_depth = 256})), random_(seed, 0xB007), means_(1 + seed % 15) {}
  void each_ms() {
    if ((means_ & 1) != 0)
      for (int i = 0; i < 4; ++i) flood();
    if ((means_ & 2) != 0 && bits() % 8 == 0) block(bits() % 2 == 0 ? std::uint8_t{125} : std::uint8_t{126});
    if ((means_ & 4) != 0 && bits() % 20 == 0) {
      BeginFirmwareUpdate q;
      q.path = FilePath("xx");
      send({.kind = TransferKind::request,
            .priority = 8,
            .data_type_id = BeginFirmwareUpdate::kType.id,
            .source = 125,
            .destination = kNode},
           q);
    }
    if ((means_ & 8) != 0 && bits() % 10 == 0) {
      send({.kind = TransferKind::message, .priority = 8, .data_type_id = NodeStatus::kType.id, .source = kNode}, NodeStatus{});
      FileRead q;
      q.offset = 256 * (bits() % 16);
      q.path = FilePath("fw");
      send({.kind = TransferKind::request, .priority = 8, .data_type_id = FileRead::kType.id, .source = kNode, .destination = 126}, q);
    }
  }

 private:
  std::uint64_t bits() { return random_.bits(++draw_); }
  void flood() {
    CanFrame f;
    f.extended = true;
    f.id = static_cast<std::uint32_t>(bits()) & 0x07FFFFFFu;  // the upper half of the priorities
    f.length = static_cast<std::uint8_t>(bits() % 9);
    for (auto& byte : f.data) byte = static_cast<std::uint8_t>(bits());
    port_.send(f);
  }
  void block(std::uint8_t source) {
    FileReadResponse r;
    const std::vector<std::uint8_t> wrong(FileRead::kBlock, 0x5A);
    r.data.assign({wrong.data(), wrong.size()});
    send({.kind = TransferKind::response, .priority = 8, .data_type_id = FileRead::kType.id, .source = source, .destination = kNode}, r);
  }
  template <class T>
  void send(const FrameId& header, const T& value) {
    std::vector<std::uint8_t> payload(max_bytes<T>());
    payload.resize(encode(value, payload));
    encode_transfer(header, T::kType.crc_seed(), static_cast<std::uint8_t>(bits() % 32), payload,
                    [&](const CanFrame& f) { return port_.send(f) == SendStatus::queued; });
  }
  CanBus& port_;
  RandomStream random_;
  std::uint64_t means_, draw_ = 0;
};

TEST(BootBesideOthers, AHostileBusDuringAnUpdateNeverInstallsAWrongByteAndItEndsRight) {
  const auto old = image_of(lives(), 1000), wanted = image_of(lives(), 3000);
  const char* by_script = std::getenv("ROTORLOOP_BOOT_SCHEDULES");
  const int schedules = by_script != nullptr ? std::atoi(by_script) : 6;
  int kept = 0, asked_again = 0;
  for (int seed = 0; seed < schedules; ++seed) {
    SCOPED_TRACE(testing::Message() << "schedule " << seed);
    BootFleet fleet(boot_elf, 1);
    Enemy enemy(fleet.bus, static_cast<std::uint64_t>(by_script != nullptr ? seed : 2 + 3 * seed));
    std::copy(old.begin(), old.end(), fleet.chip(0).memory(kArea, 1));
    write_job(fleet.chip(0));
    tools::ToolNode tool(fleet);
    tools::FirmwareUpdates updates(tool, wanted);
    const std::int64_t peace_ns = 800 * kMs;
    fleet.each_ms = [&](std::int64_t now_ns) {
      if (now_ns < peace_ns) enemy.each_ms();
    };
    fleet.power_up();
    bool ran = tool.run_until(peace_ns, [&] { return fleet.in_application(0) || fleet.refused(); });
    if (!ran) {
      ++asked_again;
      updates.start(kNode);
      ran = tool.run_until(peace_ns + 60 * kSecond, [&] {
        updates.step();
        if (updates.over()) updates.start(kNode);
        return fleet.in_application(0) || fleet.refused();
      });
    }
    ASSERT_TRUE(ran && !fleet.refused());
    ASSERT_TRUE(fleet.holds(0, wanted) || fleet.holds(0, old)) << "a wrong byte is installed";
    kept += fleet.holds(0, old) ? 1 : 0;
    if (seed % 20 != 19) continue;
    std::printf("%d schedules\n", seed + 1);
    std::fflush(stdout);
  }
  std::printf("%d hostile schedules: %d end with the new image, %d keep the old one whole; %d were asked once more\n", schedules,
              schedules - kept, kept, asked_again);
}

}  // namespace
}  // namespace rotorloop::boot_chip
