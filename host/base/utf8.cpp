#include "host/base/utf8.hpp"

#include <algorithm>
#include <string_view>

namespace rotorloop {
namespace {

void append_utf8(std::string& out, char32_t c) {
  if (c < 0x80) {
    out += static_cast<char>(c);
  } else if (c < 0x800) {
    out += static_cast<char>(0xC0 | (c >> 6));
    out += static_cast<char>(0x80 | (c & 0x3F));
  } else if (c < 0x10000) {
    out += static_cast<char>(0xE0 | (c >> 12));
    out += static_cast<char>(0x80 | ((c >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (c & 0x3F));
  } else {
    out += static_cast<char>(0xF0 | (c >> 18));
    for (const int shift : {12, 6, 0}) out += static_cast<char>(0x80 | ((c >> shift) & 0x3F));
  }
}

std::string from_utf16(std::string_view bytes, bool big_endian) {
  const auto word = [&](std::size_t i) {
    const auto a = static_cast<unsigned char>(bytes[i]), b = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<char32_t>(big_endian ? a << 8 | b : b << 8 | a);
  };
  std::string out;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    char32_t c = word(i);
    if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size()) c = 0x10000 + ((c - 0xD800) << 10) + (word(i += 2) - 0xDC00);
    append_utf8(out, c);
  }
  return out;
}

}  // namespace

std::string as_utf8(std::string bytes) {
  if (bytes.starts_with("\xEF\xBB\xBF")) return bytes.substr(3);
  if (bytes.starts_with("\xFF\xFE")) return from_utf16(std::string_view(bytes).substr(2), false);
  if (bytes.starts_with("\xFE\xFF")) return from_utf16(std::string_view(bytes).substr(2), true);
  const std::size_t looked = std::min<std::size_t>(bytes.size() / 2, 32);
  std::size_t even = 0, odd = 0;
  for (std::size_t i = 0; i < looked; ++i) {
    even += bytes[2 * i] == '\0';
    odd += bytes[2 * i + 1] == '\0';
  }
  if (looked >= 4 && odd == looked && even == 0) return from_utf16(bytes, false);
  if (looked >= 4 && even == looked && odd == 0) return from_utf16(bytes, true);
  return bytes;
}

}  // namespace rotorloop
