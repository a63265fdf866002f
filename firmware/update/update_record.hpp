// What an update leaves in a flash page of its own, so that it goes on after a reset or a power cut: who has the file and under which
// name, whose id we talk with, which image it is, and which pages of it are in place. Words are programmed once, in this order:
//   0 magic | server | own id | path length     1..25 path     26 CRC-64 of the words before
//   27 CRC-64 of the payload that the accepted header announces     28 least security version | mark     32 + n: page n of the application
//   area is programmed
#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocols/crc.hpp"
#include "protocols/dsdl.hpp"
#include "protocols/types/file.hpp"

namespace rotorloop::firmware {

template <class F>
concept UpdateFlash = requires(F f, const F& reader, std::span<std::uint8_t> out, std::uint64_t word) {
  requires F::kFlashPageBytes >= 2048;
  { reader.flash_read(std::uint32_t{}, std::uint32_t{}, out) } -> std::same_as<bool>;  // page, offset; false: not readable
  { f.flash_erase(std::uint32_t{}) } -> std::same_as<bool>;
  { f.flash_program(std::uint32_t{}, std::uint32_t{}, word) } -> std::same_as<bool>;
};

struct UpdateJob {
  std::uint8_t server = 0, own_id = 0;
  protocols::Text<protocols::FilePath::kMostBytes> path{};
};

template <UpdateFlash Flash>
class UpdateRecord {
 public:
  UpdateRecord(Flash& flash, std::uint32_t page) : flash_(flash), page_(page) {}

  // What the application calls before it resets. The least security version stays.
  bool begin(const UpdateJob& job, std::uint32_t least_security_version = 0) {
    if (!clear(std::max(security_version(), least_security_version))) return false;
    const auto words = words_of(job);
    protocols::Crc64 crc;
    for (std::uint32_t i = 0; i < words.size(); ++i) {
      crc.add_little_endian(words[i]);
      if (!put(i, words[i])) return false;
    }
    return put(kJobCrc, crc.value());
  }
  std::optional<UpdateJob> job() const {
    std::array<std::uint64_t, kJobWords> words{};
    protocols::Crc64 crc;
    for (std::uint32_t i = 0; i < words.size(); ++i) {
      const auto w = get(i);
      if (!w) return std::nullopt;
      words[i] = *w;
      crc.add_little_endian(*w);
    }
    const std::uint64_t length = words[0] >> 32;
    if ((words[0] & 0xFFFFu) != kMagic || length > 200 || get(kJobCrc) != crc.value()) return std::nullopt;
    UpdateJob job{.server = static_cast<std::uint8_t>(words[0] >> 16), .own_id = static_cast<std::uint8_t>(words[0] >> 24)};
    for (std::size_t i = 0; i < length; ++i) job.path.push_back(static_cast<std::uint8_t>(words[1 + i / 8] >> (8 * (i % 8))));
    return job;
  }
  // The image whose pages are marked; empty before its header was accepted.
  std::optional<std::uint64_t> image() const {
    const auto w = get(kImage);
    return w && *w != ~std::uint64_t{0} ? w : std::nullopt;
  }
  bool set_image(std::uint64_t crc) { return put(kImage, crc); }
  // Below which no image is accepted, while no image in place says it; 0 when there is none.
  std::uint32_t security_version() const {
    const auto w = get(kSecurity);
    return w && *w >> 32 == kMagic ? static_cast<std::uint32_t>(*w) : 0;
  }
  bool set_security_version(std::uint32_t version) { return put(kSecurity, kMagic << 32 | version); }
  bool page_done(std::uint32_t n) const { return get(kProgress + n) == std::uint64_t{kDone}; }
  bool set_page_done(std::uint32_t n) { return put(kProgress + n, kDone); }
  bool clear(std::uint32_t least_security_version) {
    return flash_.flash_erase(page_) && (least_security_version == 0 || set_security_version(least_security_version));
  }

 private:
  static constexpr std::uint32_t kJobWords = 26, kJobCrc = 26, kImage = 27, kSecurity = 28, kProgress = 32;
  static constexpr std::uint64_t kMagic = 0x5552, kDone = 0x454E4F44;  // "RU", "DONE"

  static std::array<std::uint64_t, kJobWords> words_of(const UpdateJob& job) {
    std::array<std::uint64_t, kJobWords> words{};
    words[0] = kMagic | static_cast<std::uint64_t>(job.server) << 16 | static_cast<std::uint64_t>(job.own_id) << 24 |
               static_cast<std::uint64_t>(job.path.count) << 32;
    for (std::size_t i = 0; i < job.path.count; ++i) words[1 + i / 8] |= static_cast<std::uint64_t>(job.path.items[i]) << (8 * (i % 8));
    return words;
  }
  std::optional<std::uint64_t> get(std::uint32_t word) const {
    std::array<std::uint8_t, 8> bytes{};
    if (!flash_.flash_read(page_, 8 * word, bytes)) return std::nullopt;
    static_assert(std::endian::native == std::endian::little);
    return std::bit_cast<std::uint64_t>(bytes);
  }
  bool put(std::uint32_t word, std::uint64_t value) { return flash_.flash_program(page_, 8 * word, value); }

  Flash& flash_;
  std::uint32_t page_;
};

}  // namespace rotorloop::firmware
