// A firmware image (firmware/update/image.hpp) as bytes of a file: read, made, examined.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/image/signing_key.hpp"
#include "firmware/update/image.hpp"

namespace rotorloop::cli {

// Of 1 to 16 MiB, else Error (usage).
std::vector<std::uint8_t> read_image_bytes(const std::filesystem::path& path);

// Whole or not at all: until then it is called PATH.part.
void write_image_bytes(const std::filesystem::path& path, const std::vector<std::uint8_t>& image);

// Header and payload, not signed. `header`: size and CRC are worked out here.
std::vector<std::uint8_t> made_image(firmware::ImageHeader header, const std::vector<std::uint8_t>& payload);

void sign_image(std::vector<std::uint8_t>& image, const SigningKey& key);

// What an image says of itself, and whether it holds.
struct ExaminedImage {
  firmware::ImageHeader header;
  firmware::ImageFault fault = firmware::ImageFault::none;  // of header, length, CRC and, where it is signed, SHA-512 of the payload
  bool is_signed = false;
  std::size_t payload_bytes = 0;  // that the file has behind the header
  std::string board() const;
};
ExaminedImage examined(const std::vector<std::uint8_t>& image);

// Throws Error (data_quality) that says what is wrong with the image in `path`; `likely` fits its fault.
void must_be_whole(const std::filesystem::path& path, const ExaminedImage& image);

}  // namespace rotorloop::cli
