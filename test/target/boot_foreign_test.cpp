// By environment: the bootloader of another maker, ROTORLOOP_BOOT_FOREIGN=ELF, on the emulated chip with our tool: an id, a line in the
// list, BeginFirmwareUpdate, and file.Read until the bytes of ROTORLOOP_BOOT_FOREIGN_IMAGE (without it: 3 000 that are no program) lie in
// its flash.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "host/tools/allocator.hpp"
#include "host/tools/esc_table.hpp"
#include "test/target/boot_bench.hpp"

namespace rotorloop::boot_chip {
namespace {

std::vector<std::uint8_t> foreign_image() {
  if (const char* path = std::getenv("ROTORLOOP_BOOT_FOREIGN_IMAGE")) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::vector<std::uint8_t> image(3000);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(i * 29 + i / 256 + 1);
  return image;
}

TEST(BootloaderOfOthersByScript, IsGivenAnIdAndListedAndReadsAWholeFileFromTheTool) {
  const char* elf = std::getenv("ROTORLOOP_BOOT_FOREIGN");
  if (elf == nullptr) GTEST_SKIP() << "give ROTORLOOP_BOOT_FOREIGN=ELF";
  Bench c({}, 1, elf);
  std::ranges::fill(c.bus.chip.flash().subspan(kParameterPage * kPage), std::uint8_t{0xFF});  // it has no store of ours
  std::uint8_t id = 0;
  const tools::Allocator allocator(c.tool, {}, [&](const tools::Allocated& a) { id = a.node_id; });
  c.power_up();
  ASSERT_TRUE(c.run_for(20 * kSecond, [&] { return id != 0 && c.tool.nodes().contains(id); })) << "no id, or silent with it";
  const auto info = c.tool.ask<protocols::GetNodeInfoResponse>(id, protocols::GetNodeInfo{});
  ASSERT_TRUE(info);
  std::printf("%s: node %d after %.1f s, \"%.*s\" %d.%d, mode %d\n", std::filesystem::path(elf).filename().c_str(), id,
              static_cast<double>(c.bus.now_ns()) * 1e-9, info->name_length, info->name.data(), info->software_major, info->software_minor,
              static_cast<int>(info->status.mode));
  const auto image = foreign_image();
  tools::FirmwareUpdates updates(c.tool, image);
  const std::int64_t begun_ns = c.bus.now_ns();
  updates.start(id);
  std::int64_t read_ns = begun_ns;
  c.run_for(120 * kSecond, [&] {
    updates.step();
    if (updates.nodes().at(id).phase <= tools::UpdatePhase::reading) read_ns = c.bus.now_ns();
    return updates.over() || c.bus.end != End::at_cycle;
  });
  const tools::UpdateState& s = updates.nodes().at(id);
  const auto flash = c.bus.chip.flash();
  const auto at = std::ranges::search(flash, image).begin();
  EXPECT_EQ(s.read_B, image.size());
  ASSERT_TRUE(at != flash.end()) << "its flash does not have the bytes";
  std::printf("%zu bytes read in %.2f s, in its flash at 0x%08x; then: %s %s\n", image.size(),
              static_cast<double>(read_ns - begun_ns) * 1e-9, static_cast<unsigned>(0x0800'0000 + (at - flash.begin())),
              phase_name(s.phase).c_str(), s.reason.c_str());
  for (const std::string& line : c.said) std::printf("  it said: %s\n", line.c_str());
}

}  // namespace
}  // namespace rotorloop::boot_chip
