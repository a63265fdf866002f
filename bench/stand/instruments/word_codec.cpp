#include "bench/stand/instruments/word_codec.hpp"

#include <array>
#include <bit>
#include <cmath>

namespace rotorloop::modbus {
namespace {

constexpr std::array<std::string_view, 7> kTypeNames{"u16", "s16", "u32", "s32", "f32", "u64", "f64"};
constexpr std::array<std::string_view, 4> kOrderNames{"ABCD", "CDAB", "BADC", "DCBA"};

bool words_turned(WordOrder order) { return order == WordOrder::CDAB || order == WordOrder::DCBA; }
bool bytes_turned(WordOrder order) { return order == WordOrder::BADC || order == WordOrder::DCBA; }

std::uint16_t in_order(std::uint16_t word, WordOrder order) {
  return bytes_turned(order) ? static_cast<std::uint16_t>((word << 8) | (word >> 8)) : word;
}

template <class Integer>
std::optional<std::uint64_t> integer_bits(double value, double min, double beyond) {
  if (!std::isfinite(value)) return std::nullopt;
  const double nearest = std::nearbyint(value);
  if (nearest < min || nearest >= beyond) return std::nullopt;
  return static_cast<std::uint64_t>(static_cast<Integer>(nearest));
}

}  // namespace

std::string_view name(WordType type) { return kTypeNames[static_cast<std::size_t>(type)]; }
std::string_view name(WordOrder order) { return kOrderNames[static_cast<std::size_t>(order)]; }

WordType word_type(std::string_view text) {
  std::size_t i = 0;
  while (i + 1 < kTypeNames.size() && kTypeNames[i] != text) ++i;
  return static_cast<WordType>(i);
}
WordOrder word_order(std::string_view text) {
  std::size_t i = 0;
  while (i + 1 < kOrderNames.size() && kOrderNames[i] != text) ++i;
  return static_cast<WordOrder>(i);
}

std::size_t register_count(WordType type) {
  switch (type) {
    case WordType::u16:
    case WordType::s16:
      return 1;
    case WordType::u32:
    case WordType::s32:
    case WordType::f32:
      return 2;
    case WordType::u64:
    case WordType::f64:
      return 4;
  }
  return 1;
}

std::uint64_t assemble(std::span<const std::uint16_t> registers, WordOrder order) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < registers.size(); ++i)
    bits = (bits << 16) | in_order(registers[words_turned(order) ? registers.size() - 1 - i : i], order);
  return bits;
}

void spread(std::uint64_t bits, WordOrder order, std::span<std::uint16_t> registers) {
  for (std::size_t i = registers.size(); i-- > 0; bits >>= 16)
    registers[words_turned(order) ? registers.size() - 1 - i : i] = in_order(static_cast<std::uint16_t>(bits & 0xFFFFu), order);
}

double to_number(std::uint64_t bits, WordType type) {
  switch (type) {
    case WordType::u16:
    case WordType::u32:
    case WordType::u64:
      return static_cast<double>(bits);
    case WordType::s16:
      return static_cast<double>(static_cast<std::int16_t>(bits));
    case WordType::s32:
      return static_cast<double>(static_cast<std::int32_t>(bits));
    case WordType::f32:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case WordType::f64:
      return std::bit_cast<double>(bits);
  }
  return std::nan("");
}

std::optional<std::uint64_t> to_bits(double value, WordType type) {
  switch (type) {
    case WordType::u16:
      return integer_bits<std::uint64_t>(value, 0.0, 0x1p16);
    case WordType::u32:
      return integer_bits<std::uint64_t>(value, 0.0, 0x1p32);
    case WordType::u64:
      return integer_bits<std::uint64_t>(value, 0.0, 0x1p64);
    case WordType::s16:
      if (const auto bits = integer_bits<std::int64_t>(value, -0x1p15, 0x1p15)) return *bits & 0xFFFFu;
      return std::nullopt;
    case WordType::s32:
      if (const auto bits = integer_bits<std::int64_t>(value, -0x1p31, 0x1p31)) return *bits & 0xFFFFFFFFu;
      return std::nullopt;
    case WordType::f32:
      if (std::isfinite(value) && std::abs(value) > 3.4028235677973366e38) return std::nullopt;  // the greatest float and half a step
      return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    case WordType::f64:
      return std::bit_cast<std::uint64_t>(value);
  }
  return std::nullopt;
}

}  // namespace rotorloop::modbus
