// What `rotorloop esc flash` makes of a file: the facts that an image says of itself, an ELF as the bytes in flash, refusals by name.
#include "cli/esc/flash_image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/update/image.hpp"
#include "host/base/error.hpp"
#include "test/unit/sim/mcu/elf/elf_bytes.hpp"

namespace rotorloop::cli {
namespace {

using mcu::testing::ElfBytes;
using mcu::testing::FileOnDisk;
using ::testing::HasSubstr;

constexpr std::uint32_t kArea = 0x08006000, kPayload = 3000;

std::vector<std::uint8_t> image() {
  std::vector<std::uint8_t> out(firmware::kImageHeaderBytes + kPayload, 0xFF);
  for (std::uint32_t i = 0; i < kPayload; ++i) out[firmware::kImageHeaderBytes + i] = static_cast<std::uint8_t>(i * 31 + i / 256);
  for (std::size_t i = 1000; i < 1100; ++i) out[i] = 0xFF;  // between two sections of the ELF below
  protocols::Crc64 crc;
  crc.add(std::span<const std::uint8_t>(out).subspan(firmware::kImageHeaderBytes));
  const firmware::ImageHeader h{
      .board = firmware::board_name("b_g431b_esc1"), .size = kPayload, .security_version = 7, .major = 3, .minor = 4, .crc = crc.value()};
  firmware::write_image_fields(h, out);
  return out;
}

// The image in flash as header, code up to a gap, and start values of data that run elsewhere; something in RAM and a bootloader beside it.
ElfBytes program() {
  const auto all = image();
  const auto part = [&](std::size_t begin, std::size_t end) {
    return std::vector<std::uint8_t>(all.begin() + static_cast<std::ptrdiff_t>(begin), all.begin() + static_cast<std::ptrdiff_t>(end));
  };
  ElfBytes elf;
  elf.entry = kArea + firmware::kImageHeaderBytes + 1;
  elf.sections = {{".boot", 0x08000000, 0x08000000, std::vector<std::uint8_t>(64, 0x11), 0, 6},
                  {".image_header", kArea, kArea, part(0, firmware::kImageHeaderBytes), 0, 2},
                  {".text", kArea + 512, kArea + 512, part(512, 1000), 0, 6},
                  {".data", 0x20000000, kArea + 1100, part(1100, all.size()), 0, 3},
                  {".bss", 0x20004000, 0x20004000, {}, 96, 3}};
  return elf;
}

TEST(FlashImage, AnElfIsTheBytesOfItsImageInFlashWithGapsAsErased) {
  const FileOnDisk file("flash_image.elf", program().bytes());
  EXPECT_TRUE(is_elf(program().bytes()));
  EXPECT_FALSE(is_elf(image()));
  const auto of_elf = image_of_elf(file.path);
  EXPECT_EQ(of_elf, image());
  EXPECT_EQ(image_facts(of_elf, "x").crc, image_facts(image(), "x").crc);
}

TEST(FlashImage, AnElfWithoutAnImageHeaderIsRefusedWithTheCommandsThatMakeOne) {
  ElfBytes elf = program();
  elf.sections.erase(elf.sections.begin() + 1);
  const FileOnDisk file("flash_bare.elf", elf.bytes());
  try {
    image_of_elf(file.path);
    FAIL() << "taken";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    EXPECT_THAT(e.what(), HasSubstr("flash_bare.elf: error: this ELF has no image header"));
    EXPECT_THAT(e.text().remedy, HasSubstr("rotorloop image create"));
  }
}

TEST(FlashImage, AnImageSaysBoardVersionSecurityVersionAndCrc) {
  const tools::ImageFacts f = image_facts(image(), "x");
  EXPECT_EQ(f.board, "b_g431b_esc1");
  EXPECT_EQ(f.version, "3.4");
  EXPECT_EQ(f.security_version, 7u);
  EXPECT_TRUE(f.crc);
}

TEST(FlashImage, AnotherMakersFileSaysItsCrcByItsDescriptorOrNothing) {
  std::vector<std::uint8_t> file(100, 0x55);
  EXPECT_FALSE(image_facts(file, "x").crc);
  const std::string descriptor("APDesc00\x08\x07\x06\x05\x04\x03\x02\x01", 16);
  std::copy(descriptor.begin(), descriptor.end(), file.begin() + 40);
  EXPECT_EQ(image_facts(file, "x").crc, 0x0102030405060708u);
  EXPECT_EQ(image_facts(file, "x").board, "");
}

TEST(FlashImage, ADamagedOrShortImageIsRefusedByName) {
  auto damaged = image(), cut = image(), header = image();
  damaged.back() ^= 1;
  cut.resize(2000);
  header[30] ^= 1;
  const auto refusal = [](const std::vector<std::uint8_t>& file) -> std::string {
    try {
      image_facts(file, "esc.rlf");
    } catch (const Error& e) {
      return e.what();
    }
    return "taken";
  };
  EXPECT_THAT(refusal(damaged), HasSubstr("esc.rlf: error: image is damaged: its CRC does not fit"));
  EXPECT_THAT(refusal(cut), HasSubstr("ends after 1488 of 3000 bytes"));
  EXPECT_THAT(refusal(header), HasSubstr("image header is damaged"));
}

}  // namespace
}  // namespace rotorloop::cli
