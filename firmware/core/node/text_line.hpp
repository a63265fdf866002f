// A short text put together without a C library: for log messages and readable values. What does not fit is cut off.
#pragma once
#include <cstddef>
#include <cstdint>

#include "protocols/dsdl.hpp"

namespace rotorloop::firmware {

class TextLine {
 public:
  constexpr TextLine() = default;
  constexpr TextLine(const char* text) { add(text); }  // implicit: most lines begin as a literal

  constexpr TextLine& add(const char* text) {
    for (; *text != '\0'; ++text) put(*text);
    return *this;
  }
  constexpr TextLine& add(std::int32_t v) {
    if (v < 0) put('-');
    digits(v < 0 ? 0u - static_cast<std::uint32_t>(v) : static_cast<std::uint32_t>(v));
    return *this;
  }
  constexpr TextLine& add_decimal(std::uint32_t v) {
    digits(v);
    return *this;
  }
  constexpr TextLine& add_hex(std::uint32_t v) {
    for (unsigned at = 32; at != 0; at -= 4) put("0123456789abcdef"[v >> (at - 4) & 15u]);
    return *this;
  }
  constexpr TextLine& add(const TextLine& line) {
    for (const std::uint8_t c : line.text_.view()) text_.push_back(c);
    return *this;
  }
  // With one decimal, halves away from zero; NaN and what does not fit say so.
  constexpr TextLine& add_tenths(float v) {
    if (!(v == v)) return add("?");
    if (v > 1e8f || v < -1e8f) return add(v > 0.0f ? "large" : "-large");
    if (v < 0.0f) put('-');
    const auto tenths = static_cast<std::uint32_t>((v < 0.0f ? -v : v) * 10.0f + 0.5f);
    digits(tenths / 10u);
    put('.');
    put(static_cast<char>('0' + tenths % 10u));
    return *this;
  }
  constexpr const protocols::Text<90>& text() const { return text_; }

 private:
  constexpr void digits(std::uint32_t v) {
    std::uint32_t place = 1;
    while (v / place >= 10u) place *= 10u;
    for (; place != 0; place /= 10u) put(static_cast<char>('0' + v / place % 10u));
  }
  constexpr void put(char c) { text_.push_back(static_cast<std::uint8_t>(c)); }
  protocols::Text<90> text_{};
};

}  // namespace rotorloop::firmware
