// The bits of FPSCR that arithmetic reads and sets (A2.5.3).
#pragma once
#include <cstdint>

namespace rotorloop::mcu::fp {

inline constexpr uint32_t kInvalid = 1, kDivideByZero = 2, kOverflow = 4, kUnderflow = 8, kInexact = 16, kInputDenormal = 128;
inline constexpr uint32_t kFlushToZero = 1u << 24, kDefaultNan = 1u << 25, kAlternativeHalf = 1u << 26;
enum class Rounding : uint8_t { nearest = 0, up = 1, down = 2, zero = 3 };
inline Rounding rounding(uint32_t fpscr) { return static_cast<Rounding>(fpscr >> 22 & 3); }

}  // namespace rotorloop::mcu::fp
