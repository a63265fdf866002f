// One decoded instruction: what executes it and its operands, found again by its address.
#pragma once
#include <cstdint>

namespace rotorloop::mcu {

class Core;
struct Op;
using Execute = void (*)(Core&, const Op&);

struct Op {
  uint64_t tag = ~uint64_t{0};  // address, with the context that it was decoded in (Core::context)
  Execute execute = nullptr;
  uint32_t imm = 0;
  uint8_t rd = 0, rn = 0, rm = 0, ra = 0;
  uint8_t bytes = 2, cycles = 1;
  uint8_t kind = 0;  // shift, width or variant, as its handler says
  uint8_t extra = 0;
  uint32_t last_word = 0;  // of 64 bits, in which its last halfword lies: address / 8
};
static_assert(sizeof(Op) == 32);

// Bits of a tag above the address. Bit 0 of the address is 1 inside of an IT block, where 16-bit instructions do not set flags.
inline constexpr uint64_t kTagInIt = 1;
inline constexpr uint64_t kTagPrivileged = uint64_t{1} << 32;
inline constexpr uint64_t kTagGeneration = uint64_t{1} << 33;  // counts what makes every decoded instruction void

}  // namespace rotorloop::mcu
