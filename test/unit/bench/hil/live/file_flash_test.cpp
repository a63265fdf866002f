// The flash of a simulated ESC in a file.
#include "bench/hil/live/file_flash.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "host/base/error.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::live {
namespace {

using ::testing::HasSubstr;

std::uint8_t first_byte(const FileFlash& flash, std::uint32_t page) {
  std::array<std::uint8_t, 1> byte{};
  EXPECT_TRUE(flash.flash_read(page, 0, byte));
  return byte[0];
}

TEST(FileFlash, HoldsWhatWasProgrammedAfterItsProcessIsGone) {
  const test::TempFolder folder;
  const std::string path = folder.path() / "a.flash";
  {
    FileFlash flash(path);
    EXPECT_TRUE(flash.is_new());
    EXPECT_TRUE(flash.flash_program(3, 0, 0x1122334455667788));
    EXPECT_FALSE(flash.flash_program(3, 0, 0)) << "a word is programmed once between two erasures";
    EXPECT_FALSE(flash.flash_program(3, 4, 0)) << "words are aligned";
    EXPECT_FALSE(flash.flash_program(64, 0, 0)) << "there are 64 pages";
  }
  {
    FileFlash flash(path);
    EXPECT_FALSE(flash.is_new());
    EXPECT_EQ(first_byte(flash, 3), 0x88);
    EXPECT_TRUE(flash.flash_erase(3));
  }
  EXPECT_EQ(first_byte(FileFlash(path), 3), 0xFF);
}

TEST(FileFlash, AFileInUseOrOfAnotherSizeIsRefusedWithItsName) {
  const test::TempFolder folder;
  const auto refusal = [](const std::string& path) {
    try {
      FileFlash flash(path);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  const std::string path = folder.path() / "a.flash";
  const FileFlash first(path);
  EXPECT_THAT(refusal(path), HasSubstr("a.flash: error: is the flash of an ESC that runs"));
  EXPECT_THAT(refusal(folder.write("b.flash", "text")), HasSubstr("has 4 bytes, the flash of an ESC has 131072"));
  EXPECT_THAT(refusal("/nonexistent_folder/c.flash"), HasSubstr("cannot open"));
}

}  // namespace
}  // namespace rotorloop::live
