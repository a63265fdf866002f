// What may stand behind `elf = FILE`: a program of this board's layout, whole. Everything else is refused with what was found.
#include "sim/esc/esc_program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "firmware/core/node/parameter_store.hpp"
#include "sim/esc/flash_pages.hpp"
#include "test/unit/bench/temp_folder.hpp"
#include "test/unit/sim/mcu/elf/elf_bytes.hpp"

namespace rotorloop::sim {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::uint32_t kHeaderAt = 0x08006000, kTableAt = 0x08006200;

// An ELF with one section of header, vector table and code, each as asked for.
struct Parts {
  const char* board = "b_g431b_esc1";
  std::uint32_t address = kHeaderAt, stack_pointer = 0x20002000, reset_vector = kTableAt + 9;
  std::uint16_t machine = 40;
  bool header = true, damaged = false;
};

std::vector<std::uint8_t> elf(const Parts& p) {
  std::vector<std::uint8_t> payload = mcu::testing::little_endian({p.stack_pointer, p.reset_vector, 0xE7FEE7FE, 0xE7FEE7FE});
  protocols::Crc64 crc;
  crc.add(payload);
  firmware::ImageHeader h;
  h.board = firmware::board_name(p.board);
  h.size = static_cast<std::uint32_t>(payload.size());
  h.minor = 7;
  h.crc = crc.value();
  std::vector<std::uint8_t> image(firmware::kImageHeaderBytes, 0xFF);
  if (p.header) firmware::write_image_fields(h, image);
  if (p.damaged) payload.back() ^= 1;
  image.insert(image.end(), payload.begin(), payload.end());
  mcu::testing::ElfBytes file;
  file.machine = p.machine;
  file.entry = kTableAt + 9;
  file.sections.push_back({.name = ".image_header",
                           .address = p.address,
                           .load_address = p.address,
                           .bytes = {image.begin(), image.begin() + firmware::kImageHeaderBytes},
                           .cleared_bytes = 0,
                           .flags = 2});
  file.sections.push_back({.name = ".vectors",
                           .address = p.address + firmware::kImageHeaderBytes,
                           .load_address = p.address + firmware::kImageHeaderBytes,
                           .bytes = {image.begin() + firmware::kImageHeaderBytes, image.end()}});
  return file.bytes();
}

EscProgram read(const Parts& p) {
  const mcu::testing::FileOnDisk file("program.elf", elf(p));
  return read_esc_program(file.path, ROTORLOOP_SOURCE_DIR "/vehicles/boards/b_g431b_esc1.toml");
}
std::string error(const Parts& p) {
  return rotorloop::test::error_of([&] { read(p); });
}

TEST(EscProgram, OfTheLayoutOfThisBoardIsTakenWithItsVersion) {
  const EscProgram p = read({});
  EXPECT_EQ(p.vector_table, kTableAt);
  EXPECT_EQ(p.flash.size(), 128u * 1024u);
  EXPECT_THAT(p.text(), HasSubstr("program.elf 0.7, commit 00000000"));
}
TEST(EscProgram, ForAnotherBoardIsRefusedWithBothNames) {
  EXPECT_THAT(error({.board = "other_board"}),
              AllOf(HasSubstr("\"other_board\""), HasSubstr("\"b_g431b_esc1\""), HasSubstr("scripts/firmware")));
}
TEST(EscProgram, WithoutHeaderIsRefusedWithTheAddressOfTheHeader) {
  EXPECT_THAT(error({.header = false}), AllOf(HasSubstr("0x08006000"), HasSubstr("its header is missing")));
}
TEST(EscProgram, OfAnotherLayoutIsRefused) {
  EXPECT_THAT(error({.address = 0x08004000, .reset_vector = 0x08004209}), AllOf(HasSubstr("0x08006000"), HasSubstr("header is missing")));
}
TEST(EscProgram, WithBytesThatAreNotThoseOfItsCrcIsRefused) { EXPECT_THAT(error({.damaged = true}), HasSubstr("do not have the CRC")); }
TEST(EscProgram, WithoutAVectorTableIsRefusedWithWhatLiesThere) {
  EXPECT_THAT(error({.reset_vector = 0x08001001}), AllOf(HasSubstr("0x08006200"), HasSubstr("reset vector 0x08001001")));
  EXPECT_THAT(error({.stack_pointer = 0x30000000}), HasSubstr("no stack pointer"));
}
TEST(EscProgram, ForAnotherChipIsRefused) {
  EXPECT_THAT(error({.machine = 62}), HasSubstr("ARM"));
  EXPECT_THAT(error({.address = 0x08040000}), HasSubstr("outside of the chip's memories"));
}

TEST(StoredParameters, AreThoseThatTheFirmwareLoadsFromPages62And63) {
  EscProgram p = read({});
  firmware::Parameters wanted;
  wanted.node_id = 23;
  wanted.esc_index = 2;
  wanted.resistance_ohm = 0.123f;
  store_parameters(p.flash, wanted);
  FlashPages pages(p.flash, 62);
  const firmware::StoredParameters stored = firmware::ParameterStore(pages).load();
  EXPECT_EQ(stored.state, firmware::StoreState::loaded);
  EXPECT_EQ(stored.parameters.node_id, 23);
  EXPECT_EQ(stored.parameters.esc_index, 2);
  EXPECT_EQ(stored.parameters.resistance_ohm, 0.123f);
  // Nothing of the program moved.
  const EscProgram before = read({});
  EXPECT_TRUE(std::equal(before.flash.begin(), before.flash.begin() + 62 * 2048, p.flash.begin()));
}

}  // namespace
}  // namespace rotorloop::sim
