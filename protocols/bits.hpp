// Bit codec of DroneCAN (UAVCAN v0) payloads. Bytes fill from the most significant bit down; a value of N bits goes in low
// byte first, its full bytes as they are, and the N mod 8 most significant bits as a short last group. DroneCAN
// specification, "Data structure description language", serialisation. Clamping is the encoder's job: the *_saturated calls.
#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace rotorloop::protocols {

// IEEE binary16. Halves round away from zero and NaN is 0x7FFF, as every DroneCAN implementation does; finite values clamp to
// ±65504 (saturated cast), infinities survive.
constexpr std::uint16_t to_float16(float value) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sign = (bits >> 16) & 0x8000u;
  const std::uint32_t magnitude = bits & 0x7FFFFFFFu;
  constexpr std::uint32_t kInfinity = 0x7F800000u, kMax = 0x477FE000u /* 65504 */, kSmallestNormal = 0x38800000u /* 2^-14 */;
  std::uint32_t half = 0;
  if (magnitude > kInfinity) return 0x7FFF;
  if (magnitude == kInfinity) {
    half = 0x7C00;
  } else if (magnitude >= kMax) {
    half = 0x7BFF;
  } else if (magnitude >= kSmallestNormal) {
    half = ((magnitude + 0x1000u) >> 13) - ((127u - 15u) << 10);
  } else {
    const std::uint32_t shift = 126u - (magnitude >> 23);  // to units of 2^-24, the subnormal step
    const std::uint32_t mantissa = (magnitude & 0x7FFFFFu) | 0x800000u;
    half = shift > 24u ? 0u : (mantissa + (1u << (shift - 1u))) >> shift;
  }
  return static_cast<std::uint16_t>(sign | half);
}

constexpr float from_float16(std::uint16_t half) {
  const std::uint32_t sign = (half & 0x8000u) << 16;
  const std::uint32_t exponent = (half >> 10) & 0x1Fu, mantissa = half & 0x3FFu;
  if (exponent == 0x1F) return std::bit_cast<float>(sign | 0x7F800000u | (mantissa << 13));
  if (exponent == 0) {
    const float magnitude = static_cast<float>(mantissa) * 0x1p-24f;
    return sign != 0 ? -magnitude : magnitude;
  }
  return std::bit_cast<float>(sign | ((exponent + 127u - 15u) << 23) | (mantissa << 13));
}

class BitWriter {
 public:
  explicit constexpr BitWriter(std::span<std::uint8_t> out) : out_(out) {}

  // The low `bits` (1..64) bits of `value`, which the caller knows to fit (a truncated cast otherwise).
  constexpr void put(std::uint64_t value, unsigned bits) {
    if (bits % 8u == 0 && whole_bytes(bits)) {  // most of what is sent
      std::size_t byte = bit_ / 8u;
      bit_ += bits;
      for (; bits > 32u; bits -= 8u, value >>= 8) out_[byte++] = static_cast<std::uint8_t>(value & 0xFFu);
      for (auto low = static_cast<std::uint32_t>(value); bits > 0; bits -= 8u, low >>= 8)
        out_[byte++] = static_cast<std::uint8_t>(low & 0xFFu);
      return;
    }
    for (; bits >= 8; bits -= 8, value >>= 8) group(static_cast<std::uint32_t>(value & 0xFFu), 8);
    if (bits > 0) group(static_cast<std::uint32_t>(value) & ((1u << bits) - 1u), bits);
  }
  constexpr void put_saturated(std::uint64_t value, unsigned bits) {
    const std::uint64_t max = ~std::uint64_t{0} >> (64u - bits);
    put(value > max ? max : value, bits);
  }
  constexpr void put_signed_saturated(std::int64_t value, unsigned bits) {
    const std::int64_t max = static_cast<std::int64_t>(~std::uint64_t{0} >> (65u - bits)), min = -max - 1;
    put(static_cast<std::uint64_t>(value > max ? max : value < min ? min : value), bits);
  }
  constexpr void put_float16(float value) { put(to_float16(value), 16); }
  constexpr void put_float32(float value) { put(std::bit_cast<std::uint32_t>(value), 32); }
  template <class Byte>
  constexpr void put_bytes(std::span<const Byte> bytes) {
    static_assert(sizeof(Byte) == 1);
    if (!whole_bytes(8u * bytes.size())) {
      for (const Byte b : bytes) group(static_cast<std::uint8_t>(b), 8);
      return;
    }
    for (std::size_t i = 0; i < bytes.size(); ++i) out_[bit_ / 8u + i] = static_cast<std::uint8_t>(bytes[i]);
    bit_ += 8u * bytes.size();
  }

  constexpr std::size_t bytes() const { return (bit_ + 7u) / 8u; }  // the last one is padded with zeros
  constexpr bool overflow() const { return overflow_; }             // a value did not fit and was left out

 private:
  constexpr bool whole_bytes(std::size_t bits) const { return bit_ % 8u == 0 && !overflow_ && bit_ + bits <= out_.size() * 8u; }
  constexpr void group(std::uint32_t value, unsigned bits) {
    if (overflow_ || bit_ + bits > out_.size() * 8u) {
      overflow_ = true;
      return;
    }
    const std::size_t byte = bit_ / 8u;
    const unsigned offset = bit_ % 8u;
    const std::uint32_t word = value << (16u - bits - offset);
    out_[byte] = static_cast<std::uint8_t>((offset == 0 ? 0u : out_[byte]) | (word >> 8));
    if (offset + bits > 8u) out_[byte + 1] = static_cast<std::uint8_t>(word & 0xFFu);
    bit_ += bits;
  }
  std::span<std::uint8_t> out_;
  std::size_t bit_ = 0;
  bool overflow_ = false;
};

// Bits beyond the end of the payload read as zero and set missing(): a receiver never sees stale memory.
class BitReader {
 public:
  explicit constexpr BitReader(std::span<const std::uint8_t> in) : in_(in) {}

  constexpr std::uint64_t get(unsigned bits) {
    std::uint64_t value = 0;
    unsigned shift = 0;
    for (; bits >= 8; bits -= 8, shift += 8) value |= static_cast<std::uint64_t>(group(8)) << shift;
    if (bits > 0) value |= static_cast<std::uint64_t>(group(bits)) << shift;
    return value;
  }
  template <class T>
  constexpr T get_as(unsigned bits) {
    return static_cast<T>(get(bits));
  }
  constexpr std::int32_t get_signed(unsigned bits) {
    const std::uint32_t raw = static_cast<std::uint32_t>(get(bits)), sign = 1u << (bits - 1u);
    return static_cast<std::int32_t>((raw ^ sign) - sign);
  }
  constexpr std::int64_t get_signed64(unsigned bits) {
    const std::uint64_t raw = get(bits), sign = std::uint64_t{1} << (bits - 1u);
    return static_cast<std::int64_t>((raw ^ sign) - sign);
  }
  constexpr float get_float16() { return from_float16(static_cast<std::uint16_t>(get(16))); }
  constexpr float get_float32() { return std::bit_cast<float>(static_cast<std::uint32_t>(get(32))); }

  constexpr std::size_t remaining_bits() const { return in_.size() * 8u > bit_ ? in_.size() * 8u - bit_ : 0u; }
  constexpr bool missing() const { return missing_; }

 private:
  constexpr std::uint32_t byte_at(std::size_t i) const { return i < in_.size() ? in_[i] : 0u; }
  constexpr std::uint32_t group(unsigned bits) {
    if (bits > remaining_bits()) missing_ = true;
    const std::size_t byte = bit_ / 8u;
    const std::uint32_t word = byte_at(byte) << 8 | byte_at(byte + 1);
    const std::uint32_t value = word >> (16u - bits - bit_ % 8u) & ((1u << bits) - 1u);
    bit_ += bits;
    return value;
  }
  std::span<const std::uint8_t> in_;
  std::size_t bit_ = 0;
  bool missing_ = false;
};

}  // namespace rotorloop::protocols
