// Flash pages in memory: erased to ones, a word is programmed once. Three of them: parameters twice, the record of an update.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>

namespace rotorloop::firmware {

class MemoryFlash {
 public:
  static constexpr std::uint32_t kFlashPageBytes = 2048;
  std::array<std::array<std::uint8_t, kFlashPageBytes>, 3> flash{};

  MemoryFlash() {
    for (auto& page : flash) page.fill(0xFF);
  }
  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const noexcept {
    if (page >= flash.size() || offset > kFlashPageBytes || out.size() > kFlashPageBytes - offset) return false;
    std::copy_n(flash[page].begin() + offset, out.size(), out.begin());
    return true;
  }
  bool flash_erase(std::uint32_t page) noexcept {
    if (page >= flash.size()) return false;
    flash[page].fill(0xFF);
    return true;
  }
  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) noexcept {
    if (page >= flash.size() || offset % 8 != 0 || offset > kFlashPageBytes - 8) return false;
    const auto at = flash[page].begin() + offset;
    if (!std::all_of(at, at + 8, [](std::uint8_t b) { return b == 0xFF; })) return false;  // as the real flash: erase first
    std::memcpy(&*at, &word, 8);
    return true;
  }
};

}  // namespace rotorloop::firmware
