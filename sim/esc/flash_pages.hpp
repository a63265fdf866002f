// Pages of a flash image in memory as the firmware's store and updater see them, from `first_page` on.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace rotorloop::sim {

class FlashPages {
 public:
  static constexpr std::uint32_t kFlashPageBytes = 2048;  // of an STM32G431
  FlashPages(std::span<std::uint8_t> flash, std::uint32_t first_page) : flash_(flash.subspan(first_page * std::size_t{kFlashPageBytes})) {}

  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const {
    if (!holds(page, offset, out.size())) return false;
    std::copy_n(at(page, offset), out.size(), out.begin());
    return true;
  }
  bool flash_erase(std::uint32_t page) {
    if (!holds(page, 0, kFlashPageBytes)) return false;
    std::fill_n(at(page, 0), kFlashPageBytes, std::uint8_t{0xFF});
    return true;
  }
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) {
    if (offset % 8 != 0 || !holds(page, offset, 8)) return false;
    std::uint8_t* const to = at(page, offset);
    if (!std::all_of(to, to + 8, [](std::uint8_t b) { return b == 0xFF; })) return false;  // erase first
    std::memcpy(to, &word, 8);
    return true;
  }

 private:
  bool holds(std::uint32_t page, std::uint32_t offset, std::size_t bytes) const {
    return offset <= kFlashPageBytes && bytes <= kFlashPageBytes - offset && (std::size_t{page} + 1) * kFlashPageBytes <= flash_.size();
  }
  std::uint8_t* at(std::uint32_t page, std::uint32_t offset) const { return flash_.data() + page * std::size_t{kFlashPageBytes} + offset; }

  std::span<std::uint8_t> flash_;
};

}  // namespace rotorloop::sim
