// The header in front of an application: what it is, for which board, and how to recognise that it is whole. 512 bytes, so that the
// vector table behind it is aligned as a Cortex-M wants it. Words are little-endian; unused bytes are 0xFF.
//   0 magic u32 "RLF1"   4 header version u16   6 header bytes u16   8 board char[16]   24 payload bytes u32   28 security version u32
//   32 software major u8, minor u8, 0xFFFF   36 VCS commit u32   40 CRC-64-WE of the payload   48 CRC-64-WE of bytes 0..47
//   56 Ed25519 signature over bytes 0..47 and 120..183, 64 bytes; all 0xFF: not signed (signature.hpp)   120 SHA-512 of the payload
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocols/crc.hpp"

namespace rotorloop::firmware {

inline constexpr std::uint32_t kImageMagic = 0x31464C52;  // "RLF1"
inline constexpr std::uint16_t kImageHeaderVersion = 1;
inline constexpr std::uint32_t kImageHeaderBytes = 512;
inline constexpr std::size_t kImageFieldBytes = 56;  // what is read of it

struct ImageHeader {
  std::array<char, 16> board{};  // not terminated when full
  std::uint32_t size = 0;        // of the payload behind the header
  std::uint32_t security_version = 0;
  std::uint8_t major = 0, minor = 0;
  std::uint32_t vcs_commit = 0;
  std::uint64_t crc = 0;
  friend constexpr bool operator==(const ImageHeader&, const ImageHeader&) = default;
};

enum class ImageFault : std::uint8_t {
  none,
  not_an_image,
  header_version,
  header_damaged,
  other_board,
  too_large,
  empty,
  older_security_version,
  damaged,
  truncated,
  not_signed,
  wrong_key
};

constexpr const char* image_fault_text(ImageFault fault) {
  constexpr std::array<const char*, 12> kTexts{"image is fine",
                                               "no rotorloop image: its header is missing",
                                               "image header of an unknown version",
                                               "image header is damaged",
                                               "image is for another board",
                                               "image is too large for this board",
                                               "image is empty",
                                               "image has an older security version than the installed one",
                                               "image is damaged: its CRC does not fit",
                                               "image is cut short: the file has fewer bytes than its header says",
                                               "image is not signed, and this node wants a signature",
                                               "image is signed with another key, or changed since"};
  return kTexts[static_cast<std::size_t>(fault)];
}

namespace detail {
constexpr std::uint64_t little_endian(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t n) {
  std::uint64_t v = 0;
  for (std::size_t i = 0; i < n; ++i) v |= static_cast<std::uint64_t>(bytes[at + i]) << (8u * i);
  return v;
}
}  // namespace detail

// Of the first kImageFieldBytes of an image.
constexpr ImageFault parse_image(std::span<const std::uint8_t> in, ImageHeader& out) {
  if (in.size() < kImageFieldBytes || detail::little_endian(in, 0, 4) != kImageMagic) return ImageFault::not_an_image;
  if (detail::little_endian(in, 4, 2) != kImageHeaderVersion || detail::little_endian(in, 6, 2) != kImageHeaderBytes)
    return ImageFault::header_version;
  protocols::Crc64 crc;
  crc.add(in.first(48));
  if (crc.value() != detail::little_endian(in, 48, 8)) return ImageFault::header_damaged;
  for (std::size_t i = 0; i < out.board.size(); ++i) out.board[i] = static_cast<char>(in[8 + i]);
  out.size = static_cast<std::uint32_t>(detail::little_endian(in, 24, 4));
  out.security_version = static_cast<std::uint32_t>(detail::little_endian(in, 28, 4));
  out.major = in[32];
  out.minor = in[33];
  out.vcs_commit = static_cast<std::uint32_t>(detail::little_endian(in, 36, 4));
  out.crc = detail::little_endian(in, 40, 8);
  return ImageFault::none;
}

// The other way: the first kImageFieldBytes of an image with this header. `out` has at least as many.
constexpr void write_image_fields(const ImageHeader& h, std::span<std::uint8_t> out) {
  const auto put = [&](std::size_t at, std::uint64_t v, std::size_t n) {
    for (std::size_t i = 0; i < n; ++i) out[at + i] = static_cast<std::uint8_t>(v >> (8u * i) & 0xFFu);
  };
  put(0, kImageMagic, 4);
  put(4, kImageHeaderVersion, 2);
  put(6, kImageHeaderBytes, 2);
  for (std::size_t i = 0; i < h.board.size(); ++i) out[8 + i] = static_cast<std::uint8_t>(h.board[i]);
  put(24, h.size, 4);
  put(28, h.security_version, 4);
  out[32] = h.major;
  out[33] = h.minor;
  put(34, 0xFFFF, 2);
  put(36, h.vcs_commit, 4);
  put(40, h.crc, 8);
  protocols::Crc64 crc;
  crc.add(out.first(48));
  put(48, crc.value(), 8);
}

constexpr std::array<char, 16> board_name(const char* text) {
  std::array<char, 16> name{};
  for (std::size_t i = 0; i < name.size() && text[i] != '\0'; ++i) name[i] = text[i];
  return name;
}

// May this image replace the installed one?
constexpr ImageFault check_image(const ImageHeader& h, const std::array<char, 16>& board, std::uint32_t area_bytes,
                                 std::uint32_t least_security_version) {
  if (h.board != board) return ImageFault::other_board;
  if (h.size == 0) return ImageFault::empty;
  if (h.size > area_bytes - kImageHeaderBytes) return ImageFault::too_large;
  return h.security_version < least_security_version ? ImageFault::older_security_version : ImageFault::none;
}

}  // namespace rotorloop::firmware
