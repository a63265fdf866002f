// Numbers in 16-bit Modbus registers. The specification orders the bytes of a register and says nothing of values that span several, so
// devices differ. Written here, because the float helpers of libmodbus 3.1.6 disagree with each other: what one writes the other reads as
// another number (docs/decisions, "Modbus master of our own").
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace rotorloop::modbus {

enum class WordType : std::uint8_t { u16, s16, u32, s32, f32, u64, f64 };

// In which order the bytes of a value stand on the wire; A is the most significant byte of 32 bits. Of 64 bits, ABCD is ABCDEFGH,
// CDAB is GHEFCDAB (registers turned round), BADC is BADCFEHG (bytes in each register turned round), DCBA is HGFEDCBA.
enum class WordOrder : std::uint8_t { ABCD, CDAB, BADC, DCBA };

std::string_view name(WordType type);
std::string_view name(WordOrder order);
WordType word_type(std::string_view name);  // of a name that is known
WordOrder word_order(std::string_view name);

std::size_t register_count(WordType type);  // 1, 2 or 4

// The bits of a value as one number, most significant first. `registers` holds register_count(type) of them.
std::uint64_t assemble(std::span<const std::uint16_t> registers, WordOrder order);
void spread(std::uint64_t bits, WordOrder order, std::span<std::uint16_t> registers);

// The number that bits of a type stand for; integers beyond 2^53 are rounded.
double to_number(std::uint64_t bits, WordType type);
// The bits of the nearest number of this type; none for what the type cannot hold, and for what is not finite in an integer.
std::optional<std::uint64_t> to_bits(double value, WordType type);

}  // namespace rotorloop::modbus
