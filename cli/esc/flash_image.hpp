// The image that `rotorloop esc flash` serves: what a file says of itself, and an ELF as the bytes that lie in flash.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/tools/update_plan.hpp"

namespace rotorloop::cli {

bool is_elf(std::span<const std::uint8_t> bytes);

// From the header of a rotorloop image to the program's last byte, as the ELF has them in flash. Throws Error for one without a header.
std::vector<std::uint8_t> image_of_elf(const std::filesystem::path& path);

// By the header of rotorloop's images, or the descriptor "APDesc00" that PX4 and sapog put into theirs (CRC-64 behind it). All empty for an
// image that says neither. Throws Error for an image of ours that is damaged.
tools::ImageFacts image_facts(std::span<const std::uint8_t> image, const std::string& name);

}  // namespace rotorloop::cli
