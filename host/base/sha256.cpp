#include "host/base/sha256.hpp"

#include <bit>
#include <cstring>
#include <fstream>
#include <vector>

#include "host/base/error.hpp"

namespace rotorloop {
namespace detail {

void sha256_blocks_portable(Sha256State& state, const std::uint8_t* p, std::size_t count) {
  for (; count > 0; --count, p += 64) {
    std::array<std::uint32_t, 64> w{};
    for (std::size_t i = 0; i < 16; ++i)
      w[i] = static_cast<std::uint32_t>(p[4 * i]) << 24 | static_cast<std::uint32_t>(p[4 * i + 1]) << 16 |
             static_cast<std::uint32_t>(p[4 * i + 2]) << 8 | p[4 * i + 3];
    for (std::size_t i = 16; i < 64; ++i) {
      const auto s0 = std::rotr(w[i - 15], 7) ^ std::rotr(w[i - 15], 18) ^ (w[i - 15] >> 3);
      const auto s1 = std::rotr(w[i - 2], 17) ^ std::rotr(w[i - 2], 19) ^ (w[i - 2] >> 10);
      w[i] = w[i - 16] + s0 + w[i - 7] + s1;
    }
    auto [a, b, c, d, e, f, g, h] = state;
    for (std::size_t i = 0; i < 64; ++i) {
      const auto t1 = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) + ((e & f) ^ (~e & g)) + kSha256Rounds[i] + w[i];
      const auto t2 = (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
      h = g; g = f; f = e; e = d + t1; d = c; c = b; b = a; a = t1 + t2;
    }
    const Sha256State add{a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < 8; ++i) state[i] += add[i];
  }
}

}  // namespace detail

Sha256::Sha256(bool portable) : blocks_(portable ? nullptr : detail::sha256_blocks_of_cpu()) {
  if (blocks_ == nullptr) blocks_ = &detail::sha256_blocks_portable;
}

void Sha256::add(std::string_view bytes) {
  length_ += bytes.size();
  const auto* p = reinterpret_cast<const std::uint8_t*>(bytes.data());
  std::size_t n = bytes.size();
  while (n > 0) {
    if (fill_ == 0 && n >= 64) {
      const std::size_t whole = n / 64;
      blocks_(h_, p, whole);
      p += 64 * whole;
      n -= 64 * whole;
      continue;
    }
    const std::size_t take = std::min<std::size_t>(64 - fill_, n);
    std::memcpy(buffer_.data() + fill_, p, take);
    fill_ += take;
    p += take;
    n -= take;
    if (fill_ == 64) {
      blocks_(h_, buffer_.data(), 1);
      fill_ = 0;
    }
  }
}

std::string Sha256::hex() {
  const std::uint64_t bits = length_ * 8;
  std::string tail(1, static_cast<char>(0x80));
  while ((fill_ + tail.size()) % 64 != 56) tail.push_back('\0');
  for (int i = 7; i >= 0; --i) tail.push_back(static_cast<char>(bits >> (8 * i)));
  add(tail);
  std::string out;
  for (const auto word : h_)
    for (int shift = 28; shift >= 0; shift -= 4) out.push_back("0123456789abcdef"[(word >> shift) & 15]);
  return out;
}

std::string sha256_text(std::string_view text) {
  Sha256 s;
  s.add(text);
  return s.hex();
}

std::string sha256_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error({path.generic_string(), "cannot be read", "", "check that it exists and its permissions"});
  Sha256 s;
  std::vector<char> buffer(1 << 16);
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || in.gcount() > 0)
    s.add({buffer.data(), static_cast<std::size_t>(in.gcount())});
  return s.hex();
}

}  // namespace rotorloop
