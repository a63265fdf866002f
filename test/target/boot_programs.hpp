// Images for the bootloader on the chip: the program of this repository, signed with the test key.
#pragma once
#include <filesystem>
#include <fstream>

#include "test/target/boot_chip.hpp"

namespace rotorloop::boot_chip {

inline std::vector<std::uint8_t> application_image() {
  std::ifstream in(std::filesystem::path(application_elf).replace_extension(".rlf"), std::ios::binary);
  return test_signed({std::istreambuf_iterator<char>(in), {}});
}
inline std::optional<std::uint64_t> crc_of(const std::vector<std::uint8_t>& image) {
  firmware::ImageHeader h;
  return firmware::parse_image(image, h) == firmware::ImageFault::none ? std::optional(h.crc) : std::nullopt;
}

}  // namespace rotorloop::boot_chip
