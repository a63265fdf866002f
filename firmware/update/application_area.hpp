// The part of the flash that holds the application: whether it is whole, and how a new one is written so that it counts only when it is.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/update/image.hpp"
#include "firmware/update/update_record.hpp"
#include "protocols/crc.hpp"

namespace rotorloop::firmware {

struct UpdateLayout {
  std::uint32_t first_page = 12, pages = 48;  // of the application, header included (decision 0180)
  std::uint32_t record_page = 60;             // UpdateRecord
};

template <UpdateFlash Flash>
class ApplicationArea {
 public:
  ApplicationArea(Flash& flash, const UpdateLayout& layout) : flash_(flash), layout_(layout) {}

  std::uint32_t bytes() const { return layout_.pages * Flash::kFlashPageBytes; }

  // The image that may be started: header right, payload whole. Reads all of it.
  std::optional<ImageHeader> installed(const std::array<char, 16>& board) const {
    std::array<std::uint8_t, kImageFieldBytes> head{};
    ImageHeader h;
    if (!read(0, head) || parse_image(head, h) != ImageFault::none) return std::nullopt;
    if (check_image(h, board, bytes(), 0) != ImageFault::none || payload_crc(h.size) != h.crc) return std::nullopt;
    return h;
  }

  // From here on there is no old image.
  bool erase(std::uint32_t page) { return flash_.flash_erase(layout_.first_page + page); }

  // Data at `offset` (a multiple of 8) into erased pages, filled up to a whole word with ones. The first word of the area is left out.
  bool program(std::uint32_t offset, std::span<const std::uint8_t> data) {
    for (std::uint32_t i = 0; i < data.size(); i += 8) {
      if (offset + i == 0) continue;
      if (!flash_.flash_program(layout_.first_page + (offset + i) / Flash::kFlashPageBytes, (offset + i) % Flash::kFlashPageBytes,
                                word(data, i)))
        return false;
    }
    return true;
  }
  // The magic number, last of all.
  bool release(std::span<const std::uint8_t> first_word) { return flash_.flash_program(layout_.first_page, 0, word(first_word, 0)); }
  bool first_word_erased() const {
    std::array<std::uint8_t, 8> bytes{};
    return read(0, bytes) && std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t b) { return b == 0xFF; });
  }

  // Empty when something of it cannot be read.
  std::optional<std::uint64_t> payload_crc(std::uint32_t size) const {
    protocols::Crc64 crc;
    std::array<std::uint8_t, 64> chunk{};
    for (std::uint32_t at = 0; at < size; at += static_cast<std::uint32_t>(chunk.size())) {
      const std::span<std::uint8_t> part(chunk.data(), std::min<std::size_t>(chunk.size(), size - at));
      if (!read(kImageHeaderBytes + at, part)) return std::nullopt;
      crc.add(part);
    }
    return crc.value();
  }

 private:
  static std::uint64_t word(std::span<const std::uint8_t> data, std::size_t at) {
    std::uint64_t v = 0;
    for (std::size_t i = 0; i < 8; ++i) v |= static_cast<std::uint64_t>(at + i < data.size() ? data[at + i] : 0xFF) << (8u * i);
    return v;
  }
  // Within one page: chunks divide it.
  bool read(std::uint32_t offset, std::span<std::uint8_t> out) const {
    return flash_.flash_read(layout_.first_page + offset / Flash::kFlashPageBytes, offset % Flash::kFlashPageBytes, out);
  }

  Flash& flash_;
  UpdateLayout layout_;
};

}  // namespace rotorloop::firmware
