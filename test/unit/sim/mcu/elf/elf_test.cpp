// What is read of an ELF file, and what is refused: with file, address and remedy.
#include <gtest/gtest.h>

#include "host/base/error.hpp"
#include "sim/mcu/elf/program.hpp"
#include "test/unit/sim/mcu/elf/elf_bytes.hpp"

namespace rotorloop::mcu {
namespace {

using testing::ElfBytes;
using testing::FileOnDisk;
using testing::little_endian;

constexpr uint32_t kBase = 0x08000000, kStackTop = 0x20005800;

ElfBytes program(uint32_t base = kBase) {
  ElfBytes elf;
  elf.entry = base + 9;
  elf.sections = {{".isr_vector", base, base, little_endian({kStackTop, base + 9, base + 0xD, 0, 0xBF00BF00}), 0, 2},
                  {".data", 0x20000000, base + 0x20, little_endian({1, 2, 3}), 0, 3},
                  {".bss", 0x2000000C, 0x2000000C, {}, 100, 3}};
  elf.symbols = {{"main.cpp", 0, 0, 4}, {"_Z5pollsi", kBase + 9, 4, 2}, {"vectors", kBase, 16, 0x11}};
  return elf;
}

// The message of the refusal of a file; empty when it is taken.
std::string refusal(const ElfBytes& elf) {
  const FileOnDisk file("refused.elf", elf.bytes());
  try {
    const ElfFile read = read_elf(file.path);
    check_sections(read, stm32g431_memories());
    vector_table(read, stm32g431_memories());
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    EXPECT_EQ(e.text().where, file.path.generic_string());
    EXPECT_FALSE(e.text().remedy.empty());
    return e.text().what;
  }
  return "";
}

testing::ElfBytes changed(void (*change)(ElfBytes&)) {
  ElfBytes elf = program();
  change(elf);
  return elf;
}

TEST(McuElf, SectionsHaveTheAddressTheyRunAtAndTheAddressTheyAreLoadedTo) {
  const FileOnDisk file("good.elf", program().bytes());
  const ElfFile elf = read_elf(file.path);
  ASSERT_EQ(elf.sections.size(), 3u);
  EXPECT_EQ(elf.sections[1].name, ".data");
  EXPECT_EQ(elf.sections[1].run_address, 0x20000000u);
  EXPECT_EQ(elf.sections[1].load_address, kBase + 0x20);
  EXPECT_EQ(elf.sections[1].bytes, little_endian({1, 2, 3}));
  EXPECT_EQ(elf.sections[2].name, ".bss");
  EXPECT_EQ(elf.sections[2].size_bytes, 100u);
  EXPECT_TRUE(elf.sections[2].bytes.empty());
}

TEST(McuElf, AnAddressInsideOfAFunctionHasItsDemangledNameAndSource) {
  const FileOnDisk file("names.elf", program().bytes());
  const ElfFile elf = read_elf(file.path);
  EXPECT_EQ(elf.place(kBase + 8), "polls(int)");
  EXPECT_EQ(elf.place(kBase + 11), "polls(int) + 0x2");
  EXPECT_EQ(elf.symbol_at(kBase + 8)->source_file, "main.cpp");
  EXPECT_EQ(elf.place(kBase + 0x1000), "0x08001000");
}

TEST(McuElf, TheVectorTableEndsWithItsObject) {
  const FileOnDisk file("vectors.elf", program().bytes());
  const VectorTable table = vector_table(read_elf(file.path), stm32g431_memories());
  EXPECT_EQ(table.address, kBase);
  EXPECT_EQ(table.stack_pointer, kStackTop);
  EXPECT_EQ(table.vectors, (std::vector<uint32_t>{kBase + 9, kBase + 0xD}));
  EXPECT_EQ(exception_name(15), "SysTick");
  EXPECT_EQ(exception_name(16 + 21), "interrupt 21");
}

TEST(McuElf, SettingsBeforeTheProgramAreNotTakenForItsVectorTable) {
  const FileOnDisk file("settings.elf", changed([](ElfBytes& e) {
                                          e.sections[0].name = ".text";
                                          e.sections[0].address = e.sections[0].load_address = kBase + 0x800;
                                        }).bytes());
  EXPECT_EQ(vector_table(read_elf(file.path), stm32g431_memories()).address, kBase + 0x800);
}

TEST(McuElf, AFileWithoutSectionHeadersIsReadByItsSegments) {
  std::vector<uint8_t> bytes = program().bytes();
  std::fill(bytes.begin() + 32, bytes.begin() + 36, uint8_t{0});  // where the section headers are
  bytes[48] = bytes[49] = bytes[50] = bytes[51] = 0;              // how many, and which has the names
  const FileOnDisk file("segments.elf", bytes);
  const ElfFile elf = read_elf(file.path);
  ASSERT_EQ(elf.sections.size(), 3u);
  EXPECT_EQ(elf.sections[0].bytes.size(), 20u);
  EXPECT_EQ(elf.sections[1].load_address, kBase + 0x20);
}

TEST(McuElf, WhatIsNoProgramForThisChipIsRefusedByName) {
  EXPECT_EQ(refusal(program()), "");
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.machine = 62; })), "is not for ARM (machine 62 of its header, ARM is 40)");
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.order = 2; })), "is not 32 bits, little endian");
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.type = 1; })), "is not linked (type 1 of its header, a program is 2)");
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.sections.clear(); })), "has nothing to load");
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.entry = 0x20000001; })), "its entry is 0x20000001, which is not in flash");
  const std::string outside = refusal(changed([](ElfBytes& e) { e.sections[1].load_address = 0x0801FFFC; }));
  EXPECT_TRUE(
      outside.starts_with("section .data is at 0x0801fffc, 12 bytes: outside of the chip's memories (flash 0x08000000 to 0x0801ffff"))
      << outside;
  const std::string too_much = refusal(changed([](ElfBytes& e) { e.sections[2].cleared_bytes = 0x8000; }));
  EXPECT_TRUE(too_much.starts_with("section .bss is at 0x2000000c, 32768 bytes: outside")) << too_much;
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.sections[0].bytes[3] = 0x08; })),
            "no stack pointer at 0x08000000, the start of .isr_vector: 0x08005800 is no multiple of 4 in a RAM");
  EXPECT_EQ(refusal(changed([](ElfBytes& e) { e.sections[0].bytes[4] = 8; })),
            "its reset vector at 0x08000004 is 0x08000008: not the odd address of a Thumb instruction in a memory");
}

TEST(McuElf, AFileThatIsCutShortOrNoElfIsRefused) {
  std::vector<uint8_t> bytes = program().bytes();
  const FileOnDisk text("text.elf", {'h', 'e', 'l', 'l', 'o'});
  EXPECT_THROW(read_elf(text.path), Error);
  EXPECT_THROW(read_elf(text.path / "missing"), Error);
  for (size_t length = 4; length < bytes.size(); length += 7) {
    const FileOnDisk cut("cut.elf", {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length)});
    EXPECT_THROW(read_elf(cut.path), Error) << length;
  }
}

TEST(McuElf, TwoFilesOnOneAddressAreRefusedAndTwoBesideEachOtherAreNot) {
  const FileOnDisk boot("boot.elf", program().bytes()), beside("beside.elf", program(kBase + 0x4000).bytes());
  const FileOnDisk over("over.elf", program(kBase + 0x10).bytes());
  const ElfFile first = read_elf(boot.path);
  EXPECT_NO_THROW(check_overlap(std::vector{first, read_elf(beside.path)}));
  try {
    check_overlap(std::vector{first, read_elf(over.path)});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.text().what,
              "section .isr_vector and section .isr_vector of " + boot.path.generic_string() + " both want 0x08000010 to 0x08000013");
  }
}

}  // namespace
}  // namespace rotorloop::mcu
