// Flash memory as an STM32G4 has it: 2 KB pages that are erased to ones, 8-byte words that are programmed once after an erase, and the
// times that both take. Power may be cut in the middle of any operation: what was being written is then torn, and every later
// operation fails until power_on(). Numbers: STM32G431 data sheet DS12589, flash memory characteristics (typical).
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace rotorloop::firmware {

// What a cut leaves of the operation that it hit.
enum class Torn : std::uint8_t {
  untouched,   // the supply went just before
  half,        // half of the page erased, half of the word's bits programmed: such a word is unreadable (ECC)
  unreadable,  // erased or programmed too weakly: reads fail
  done,        // the supply went just after
};

class EmulatedFlash {
 public:
  static constexpr std::uint32_t kFlashPageBytes = 2048;
  static constexpr std::uint64_t kErase_us = 22'100, kProgram_us = 85;

  explicit EmulatedFlash(std::uint32_t pages) : bytes_(pages * std::size_t{kFlashPageBytes}, 0xFF), bad_(bytes_.size() / 8) {}

  std::uint32_t pages() const { return static_cast<std::uint32_t>(bytes_.size() / kFlashPageBytes); }
  std::uint64_t operations() const { return operations_; }
  std::uint64_t busy_us() const { return busy_us_; }
  bool powered() const { return powered_; }
  void power_on() {
    powered_ = true;
    cut_at_ = ~std::uint64_t{0};
  }
  // The operation with this number (counted from 0 over the life of the flash) is hit.
  void cut_at(std::uint64_t operation, Torn torn) {
    cut_at_ = operation;
    torn_ = torn;
  }

  bool flash_read(std::uint32_t page, std::uint32_t offset, std::span<std::uint8_t> out) const {
    if (!powered_ || page >= pages() || offset > kFlashPageBytes || out.size() > kFlashPageBytes - offset) return false;
    const std::size_t from = page * std::size_t{kFlashPageBytes} + offset;
    for (std::size_t word = from / 8; word * 8 < from + out.size(); ++word) {
      if (bad_[word]) return false;
    }
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(from), out.size(), out.begin());
    return true;
  }

  bool flash_erase(std::uint32_t page) {
    if (page >= pages() || !begin(kErase_us)) return false;
    const bool cut = !powered_;
    const std::size_t first = page * std::size_t{kFlashPageBytes} / 8, words = kFlashPageBytes / 8;
    for (std::size_t k = 0; k < words; ++k) {
      if (cut && (torn_ == Torn::untouched || (torn_ == Torn::half && k % 2 == 0))) continue;
      std::fill_n(bytes_.begin() + static_cast<std::ptrdiff_t>(8 * (first + k)), 8, std::uint8_t{0xFF});
      bad_[first + k] = cut && torn_ == Torn::unreadable;
    }
    return !cut;
  }

  bool flash_program(std::uint32_t page, std::uint32_t offset, std::uint64_t word) {
    if (page >= pages() || offset % 8 != 0 || offset > kFlashPageBytes - 8) return false;
    const std::size_t at = page * std::size_t{kFlashPageBytes} + offset;
    if (!std::all_of(bytes_.begin() + static_cast<std::ptrdiff_t>(at), bytes_.begin() + static_cast<std::ptrdiff_t>(at + 8),
                     [](std::uint8_t b) { return b == 0xFF; })) {
      return false;  // erase first
    }
    if (!begin(kProgram_us)) return false;
    const bool cut = !powered_;
    if (cut && torn_ == Torn::untouched) return false;
    const std::uint64_t bits = cut && torn_ == Torn::half ? word | 0x00FF00FF00FF00FFu : word;
    for (std::size_t k = 0; k < 8; ++k) bytes_[at + k] = static_cast<std::uint8_t>(bits >> (8 * k) & 0xFFu);
    bad_[at / 8] = cut && torn_ != Torn::done;
    return !cut;
  }

 private:
  // False without power. The cut takes the power during this operation.
  bool begin(std::uint64_t duration_us) {
    if (!powered_) return false;
    busy_us_ += duration_us;
    if (operations_++ == cut_at_) powered_ = false;
    return true;
  }

  std::vector<std::uint8_t> bytes_;
  std::vector<bool> bad_;
  std::uint64_t operations_ = 0, busy_us_ = 0, cut_at_ = ~std::uint64_t{0};
  Torn torn_ = Torn::untouched;
  bool powered_ = true;
};

}  // namespace rotorloop::firmware
