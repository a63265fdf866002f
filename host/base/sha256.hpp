// SHA-256 of files and texts: run folders name their inputs and logs by it.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "host/base/sha256_blocks.hpp"

namespace rotorloop {

class Sha256 {
 public:
  // `portable`: plain C++ even where the CPU has instructions for it; the digest is the same.
  explicit Sha256(bool portable = false);
  void add(std::string_view bytes);
  std::string hex();  // ends the hash; the object is used up

 private:
  detail::Sha256Blocks blocks_;
  detail::Sha256State h_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> buffer_{};
  std::size_t fill_ = 0;
  std::uint64_t length_ = 0;
};

std::string sha256_text(std::string_view text);
std::string sha256_file(const std::filesystem::path& path);  // throws Error when it cannot be read

}  // namespace rotorloop
