// `rotorloop mcu info`: what it prints of a program, and how it ends on what is none.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/commands.hpp"
#include "host/base/error.hpp"
#include "test/unit/sim/mcu/elf/elf_bytes.hpp"

namespace rotorloop::cli {
namespace {

using mcu::testing::ElfBytes;
using mcu::testing::FileOnDisk;
using mcu::testing::little_endian;

// What the command writes to stdout; errors are thrown as they are to main().
std::string output(std::vector<std::string> arguments) {
  CLI::App app;
  int exit_code = -1;
  add_mcu(app, exit_code);
  std::vector<const char*> argv{"rotorloop", "mcu", "info"};
  for (const std::string& a : arguments) argv.push_back(a.c_str());
  ::testing::internal::CaptureStdout();
  try {
    app.parse(static_cast<int>(argv.size()), argv.data());
  } catch (...) {
    ::testing::internal::GetCapturedStdout();
    throw;
  }
  EXPECT_EQ(exit_code, 0);
  return ::testing::internal::GetCapturedStdout();
}

ElfBytes program(uint32_t base) {
  ElfBytes elf;
  elf.entry = base + 0x11;
  elf.sections = {{".vectors", base, base, little_endian({0x20005800, base + 0x11, base + 0x15, base + 0x15}), 0, 2},
                  {".text", base + 16, base + 16, little_endian({0xE7FEBF00, 0xE7FEE7FE}), 0, 6},
                  {".data", 0x20000000, base + 24, little_endian({7}), 0, 3},
                  {".bss", 0x20000004, 0x20000004, {}, 96, 3}};
  elf.symbols = {{"reset", base + 0x11, 4}, {"stop", base + 0x15, 4}};
  return elf;
}

TEST(McuInfo, JsonCountsEachMemoryAndNamesEachHandler) {
  const FileOnDisk file("info.elf", program(0x08000000).bytes());
  const auto document = nlohmann::json::parse(output({file.path.string(), "--json"}));
  EXPECT_EQ(document["memories"][0]["memory"], "flash");
  EXPECT_EQ(document["memories"][0]["used_bytes"], 16 + 8 + 4);
  EXPECT_EQ(document["memories"][1]["used_bytes"], 4 + 96);
  const auto& first = document["files"][0];
  EXPECT_EQ(first["entry_function"], "reset");
  EXPECT_EQ(first["stack_pointer"], 0x20005800u);
  EXPECT_EQ(first["vectors"][1]["name"], "NMI");
  EXPECT_EQ(first["vectors"][1]["handler"], "stop");
  EXPECT_EQ(first["sections"][1]["kind"], "code");
}

TEST(McuInfo, ABootloaderAndAnApplicationAreCountedTogether) {
  const FileOnDisk boot("boot.elf", program(0x08000000).bytes()), application("application.elf", program(0x08004000).bytes());
  const std::string text = output({boot.path.string(), application.path.string()});
  EXPECT_NE(text.find("flash                          0x08000000     131072       56   131016"), std::string::npos) << text;
  EXPECT_NE(text.find("NMI, HardFault               0x08004015   stop"), std::string::npos) << text;
}

TEST(McuInfo, WhatDoesNotFitIsRefusedAsAMistakeOfTheUser) {
  ElfBytes large = program(0x08000000);
  large.sections[1].address = large.sections[1].load_address = 0x08020000;
  const FileOnDisk file("large.elf", large.bytes());
  try {
    output({file.path.string()});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    EXPECT_NE(std::string(e.what()).find("section .text is at 0x08020000, 8 bytes: outside"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace rotorloop::cli
