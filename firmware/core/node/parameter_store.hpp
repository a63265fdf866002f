// Parameters over a power cut: two flash pages that take turns. A page counts only when its last word, the CRC over all before it,
// is there and right; of two that count the one with the higher sequence number is the newer. Saving erases and fills the other page,
// so that a cut at any moment leaves the one or the other. Each value is stored with a hash of its name: a firmware that has gained or
// lost parameters reads what it still knows.
//   word 0: magic u16 | count u16 | sequence u32     words 1..count: name hash u32 | value float32     last word: CRC-64
#pragma once
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/core/node/parameters.hpp"
#include "protocols/crc.hpp"

namespace rotorloop::firmware {

// The part of the Board concept that the store needs; time is the board's business.
template <class F>
concept ParameterFlash = requires(F f, const F& reader, std::span<std::uint8_t> out, std::uint64_t word) {
  requires F::kFlashPageBytes >= 1024;
  { reader.flash_read(std::uint32_t{}, std::uint32_t{}, out) } -> std::same_as<bool>;  // page, offset; false: not readable (ECC)
  { f.flash_erase(std::uint32_t{}) } -> std::same_as<bool>;
  { f.flash_program(std::uint32_t{}, std::uint32_t{}, word) } -> std::same_as<bool>;
};

enum class StoreState : std::uint8_t {
  loaded,
  empty,    // both pages erased: a new board
  corrupt,  // something is there, but no whole page
};

struct StoredParameters {
  Parameters parameters{};  // defaults for what is not stored; each value inside its range
  StoreState state = StoreState::empty;
  std::uint16_t clamped = 0;  // values that were outside their range
  std::uint16_t unknown = 0;  // stored names that this firmware does not have
};

template <ParameterFlash Flash>
class ParameterStore {
 public:
  explicit ParameterStore(Flash& flash) : flash_(flash) {}

  StoredParameters load() const {
    StoredParameters out;
    const auto newest = newest_page();
    if (!newest) {
      out.state = erased(0) && erased(1) ? StoreState::empty : StoreState::corrupt;
      return out;
    }
    out.state = StoreState::loaded;
    for (std::uint32_t i = 1; i <= newest->count; ++i) {
      const std::uint64_t word = read(newest->page, i).value_or(0);
      if (!take(out, static_cast<std::uint32_t>(word), std::bit_cast<float>(static_cast<std::uint32_t>(word >> 32)))) ++out.unknown;
    }
    return out;
  }

  // One value as it is stored, by parameter_hash(): for a program that knows none of the others.
  std::optional<float> value(std::uint32_t hash) const {
    const auto newest = newest_page();
    for (std::uint32_t i = 1; newest && i <= newest->count; ++i) {
      const std::uint64_t word = read(newest->page, i).value_or(0);
      if (static_cast<std::uint32_t>(word) == hash) return std::bit_cast<float>(static_cast<std::uint32_t>(word >> 32));
    }
    return std::nullopt;
  }

  // Into the page that does not hold the newest values. False: the flash refused; the values before are still there.
  bool save(const Parameters& p) {
    const auto newest = newest_page();
    const std::uint32_t page = newest ? 1u - newest->page : 0u, sequence = newest ? newest->sequence + 1u : 1u;
    if (!flash_.flash_erase(page)) return false;
    protocols::Crc64 crc;
    std::uint32_t at = 0;
    const auto put = [&](std::uint64_t word) {
      crc.add_little_endian(word);
      return flash_.flash_program(page, 8u * at++, word);
    };
    if (!put(kMagic | static_cast<std::uint64_t>(kParameterRanges.size()) << 16 | static_cast<std::uint64_t>(sequence) << 32)) return false;
    for (const ParameterRange& r : kParameterRanges) {
      if (!put(parameter_hash(r.name) | static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(r.get(p))) << 32)) return false;
    }
    if (!flash_.flash_program(page, 8u * at, crc.value())) return false;
    const auto written = page_at(page);
    return written && written->sequence == sequence;
  }

 private:
  static constexpr std::uint64_t kMagic = 0x5250;  // "PR"
  static constexpr std::uint32_t kMostWords = Flash::kFlashPageBytes / 8u;
  static_assert(kParameterRanges.size() + 2 <= kMostWords, "the parameters have outgrown a flash page");

  struct Page {
    std::uint32_t page = 0, count = 0, sequence = 0;
  };

  std::optional<std::uint64_t> read(std::uint32_t page, std::uint32_t word) const {
    std::array<std::uint8_t, 8> bytes{};
    if (!flash_.flash_read(page, 8u * word, bytes)) return std::nullopt;
    static_assert(std::endian::native == std::endian::little);
    return std::bit_cast<std::uint64_t>(bytes);
  }

  std::optional<Page> page_at(std::uint32_t page) const {
    const auto head = read(page, 0);
    if (!head || (*head & 0xFFFFu) != kMagic) return std::nullopt;
    const Page p{
        .page = page, .count = static_cast<std::uint32_t>(*head >> 16 & 0xFFFFu), .sequence = static_cast<std::uint32_t>(*head >> 32)};
    if (p.count + 2 > kMostWords) return std::nullopt;
    protocols::Crc64 crc;
    for (std::uint32_t i = 0; i <= p.count; ++i) {
      const auto word = read(page, i);
      if (!word) return std::nullopt;
      crc.add_little_endian(*word);
    }
    return read(page, p.count + 1) == crc.value() ? std::optional(p) : std::nullopt;
  }

  std::optional<Page> newest_page() const {
    const auto a = page_at(0), b = page_at(1);
    if (!a || !b) return a ? a : b;
    return static_cast<std::int32_t>(a->sequence - b->sequence) > 0 ? a : b;
  }

  bool erased(std::uint32_t page) const {
    for (std::uint32_t i = 0; i < kMostWords; ++i) {
      if (read(page, i) != ~std::uint64_t{0}) return false;
    }
    return true;
  }

  static bool take(StoredParameters& out, std::uint32_t hash, float value) {
    for (const ParameterRange& r : kParameterRanges) {
      if (parameter_hash(r.name) != hash) continue;
      const float inside = clamp_parameter(r, value);
      if (inside != value) ++out.clamped;
      r.set(out.parameters, inside);
      return true;
    }
    return false;
  }

  Flash& flash_;
};

}  // namespace rotorloop::firmware
