// The part of the flash that holds the application: whether it is whole, and how a new one is written so that it counts only when it is.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/update/image.hpp"
#include "firmware/update/image_check.hpp"
#include "firmware/update/update_record.hpp"

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

  // The image that may be started: header right, payload whole, with a key also signed. Reads all of it.
  std::optional<ImageHeader> installed(const std::array<char, 16>& board, const UpdateKey& key) const {
    std::array<std::uint8_t, kImageHeadBytes> head{};
    ImageHeader h;
    if (!read(0, head) || parse_image(head, h) != ImageFault::none) return std::nullopt;
    if (check_image(h, board, bytes(), 0) != ImageFault::none || fault_in_place(head, h, key) != ImageFault::none) return std::nullopt;
    return h;
  }
  // Of the image whose payload is in place, and whose first word, which is not, is `first_word`.
  ImageFault fault_before_release(std::span<const std::uint8_t> first_word, const ImageHeader& h, const UpdateKey& key) const {
    std::array<std::uint8_t, kImageHeadBytes> head{};
    if (!read(0, head)) return ImageFault::damaged;
    std::copy_n(first_word.begin(), 8, head.begin());
    ImageHeader in_place;
    if (parse_image(head, in_place) != ImageFault::none || !(in_place == h)) return ImageFault::damaged;
    return fault_in_place(head, h, key);
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

  // The least security version, left in an area without an image while the record is erased and written again (updater.hpp). Erases the
  // first page.
  bool leave_security_version(std::uint32_t version) {
    return erase(0) && flash_.flash_program(layout_.first_page, 8, kVersionMark << 32 | version);
  }
  std::uint32_t left_security_version() const {
    std::array<std::uint8_t, 8> bytes{};
    if (!first_word_erased() || !read(8, bytes) || detail::little_endian(bytes, 4, 4) != kVersionMark) return 0;
    return static_cast<std::uint32_t>(detail::little_endian(bytes, 0, 4));
  }

 private:
  static constexpr std::uint64_t kVersionMark = 0x53454356;  // no version of a header: its u16 would be 0x4356

  ImageFault fault_in_place(std::span<const std::uint8_t> head, const ImageHeader& h, const UpdateKey& key) const {
    std::array<std::uint8_t, 64> chunk{};
    for (std::uint32_t at = kImageHeadBytes; at < kImageHeaderBytes; at += 8) {  // what nobody signs is as it was erased
      const std::span<std::uint8_t> part(chunk.data(), 8);
      if (!read(at, part) || std::any_of(part.begin(), part.end(), [](std::uint8_t b) { return b != 0xFF; }))
        return ImageFault::header_damaged;
    }
    if (const ImageFault f = signature_fault(head, key); f != ImageFault::none) return f;
    PayloadCheck check;
    for (std::uint32_t at = 0; at < h.size; at += static_cast<std::uint32_t>(chunk.size())) {
      const std::span<std::uint8_t> part(chunk.data(), std::min<std::size_t>(chunk.size(), h.size - at));
      if (!read(kImageHeaderBytes + at, part)) return ImageFault::damaged;
      check.add(part);
    }
    return check.fits(head, h) ? ImageFault::none : ImageFault::damaged;
  }
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
