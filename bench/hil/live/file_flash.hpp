// The flash of a simulated ESC, in a file: what was programmed is there after a restart and after a kill at any moment. Pages, words and
// times are those of the emulated flash of the tests (firmware/board/fake/emulated_flash.hpp). Without a path it lives as long as the
// process.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware/board/fake/emulated_flash.hpp"

namespace rotorloop::live {

class FileFlash {
 public:
  static constexpr std::uint32_t kFlashPageBytes = firmware::EmulatedFlash::kFlashPageBytes;
  static constexpr std::uint32_t kPages = 64;  // 128 KB: an STM32G431

  // Throws Error: device when the file cannot be made or another process has it, usage when it has another size.
  explicit FileFlash(const std::string& path);
  ~FileFlash();
  FileFlash(const FileFlash&) = delete;
  FileFlash& operator=(const FileFlash&) = delete;

  bool is_new() const { return is_new_; }             // nothing was ever programmed
  std::uint64_t busy_us() const { return busy_us_; }  // time that a processor would have stood still
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const;
  bool flash_erase(std::uint32_t page);
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word);  // false: not erased before

 private:
  static bool inside(std::uint32_t page, std::uint32_t offset, std::size_t size) {
    return page < kPages && offset + size <= kFlashPageBytes;
  }
  bool keep(std::size_t at, std::size_t size);  // in the file

  std::vector<std::uint8_t> bytes_;
  std::uint64_t busy_us_ = 0;
  int file_ = -1;
  bool is_new_ = true;
};

// Some pages of that flash, counted from 0, as the board of an application has them (firmware/board/application_board.hpp).
class BoardPages {
 public:
  static constexpr std::uint32_t kFlashPageBytes = FileFlash::kFlashPageBytes;
  BoardPages(FileFlash& flash, const std::array<std::uint32_t, 3>& pages) : flash_(&flash), pages_(pages) {}
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const {
    return page < pages_.size() && flash_->flash_read(pages_[page], offset, out);
  }
  bool flash_erase(std::uint32_t page) { return page < pages_.size() && flash_->flash_erase(pages_[page]); }
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) {
    return page < pages_.size() && flash_->flash_program(pages_[page], offset, word);
  }

 private:
  FileFlash* flash_;
  std::array<std::uint32_t, 3> pages_;
};

}  // namespace rotorloop::live
