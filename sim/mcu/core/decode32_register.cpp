// 32-bit data processing with registers (A5.3.12 to A5.3.15), multiplication and division (A5.3.16, A5.3.17).
#include <bit>

#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"
#include "sim/mcu/core/state.hpp"

namespace rotorloop::mcu {
namespace {

uint8_t field(uint32_t word, uint32_t lowest) { return static_cast<uint8_t>(word >> lowest & 15); }

// Reversals, saturating additions, SEL and CLZ (A5.3.15).
Execute miscellaneous_register(Op& op, uint32_t group, uint32_t which) {
  static constexpr Execute kReverse[4] = {exec::rev, exec::rev16, exec::rbit, exec::revsh};
  op.kind = static_cast<uint8_t>(which & 3);
  switch (group) {
    case 0:
      return exec::saturating_add;
    case 1:
      return kReverse[which & 3];
    case 2:
      return which == 8 ? exec::select_bytes : exec::undefined;
    default:
      return which == 8 ? exec::clz : exec::undefined;
  }
}

}  // namespace

void decode_register(Op& op, uint32_t first, uint32_t second) {
  const uint32_t group = first >> 4 & 15, which = second >> 4 & 15;
  op.execute = exec::undefined;
  op.rd = field(second, 8);
  op.rn = field(first, 0);
  op.rm = field(second, 0);
  if ((second & 0xF000) != 0xF000) return;
  if (group < 8) {
    if (which == 0) {
      op.kind = static_cast<uint8_t>(group >> 1);
      op.execute = (group & 1) != 0 ? exec::shift_by_register_flags : exec::shift_by_register;
    } else if (which >= 8 && group < 6 && (which & 4) == 0) {
      static constexpr uint8_t kKind[6] = {1, 3, 4, 5, 0, 2};
      op.kind = kKind[group];
      op.imm = (which & 3) * 8;
      if (op.rn == kPc) op.rn = kZero;
      op.execute = exec::extend;
    }
    return;
  }
  if (which < 8) {
    static constexpr Execute kParallel[8] = {exec::signed_parallel,   exec::saturating_parallel, exec::signed_halving,   exec::undefined,
                                             exec::unsigned_parallel, exec::unsigned_saturating, exec::unsigned_halving, exec::undefined};
    op.kind = static_cast<uint8_t>(group & 7);
    op.execute = op.kind == 3 || op.kind == 7 ? exec::undefined : kParallel[which];
    return;
  }
  if (group < 12 && which < 12) op.execute = miscellaneous_register(op, group & 3, which);
}

void decode_multiply(Op& op, uint32_t first, uint32_t second) {
  const uint32_t group = first >> 4 & 7, which = second >> 4 & 15;
  op.rd = field(second, 8);
  op.rn = field(first, 0);
  op.rm = field(second, 0);
  op.ra = field(second, 12);
  op.kind = static_cast<uint8_t>(which);
  op.extra = static_cast<uint8_t>(group == 4 ? 1 : 0);
  op.execute = exec::undefined;
  if (which > 3) return;
  const bool accumulates = op.ra != kPc;
  switch (group) {
    case 0:
      if (which > 1) return;
      op.execute = which == 1 ? exec::multiply_subtract : accumulates ? exec::multiply_accumulate : exec::multiply;
      op.cycles = accumulates || which == 1 ? cost::kMultiplyAccumulate : cost::kOne;
      return;
    case 1:
      op.execute = exec::multiply_halfwords;
      break;
    case 2:
    case 4:
      op.execute = which < 2 ? exec::dual_multiply : exec::undefined;
      break;
    case 3:
      op.execute = which < 2 ? exec::multiply_word_halfword : exec::undefined;
      break;
    case 5:
    case 6:
      op.extra = group == 6 ? 1 : 0;
      op.execute = which < 2 ? exec::most_significant : exec::undefined;
      break;
    default:
      op.execute = which == 0 ? exec::absolute_differences : exec::undefined;
      break;
  }
  if (!accumulates) op.ra = kZero;
}

void decode_long_multiply(Op& op, uint32_t first, uint32_t second) {
  const uint32_t group = first >> 4 & 7, which = second >> 4 & 15;
  op.rd = field(second, 8);   // high word, or the quotient
  op.ra = field(second, 12);  // low word
  op.rn = field(first, 0);
  op.rm = field(second, 0);
  op.kind = static_cast<uint8_t>(which & 3);
  op.extra = group == 5 ? 1 : 0;
  op.execute = exec::undefined;
  switch (group << 4 | which) {
    case 0x00:
      op.execute = exec::signed_long;
      return;
    case 0x1F:
      op.execute = exec::signed_divide;
      return;
    case 0x20:
      op.execute = exec::unsigned_long;
      return;
    case 0x3F:
      op.execute = exec::unsigned_divide;
      return;
    case 0x40:
      op.execute = exec::signed_long_accumulate;
      return;
    case 0x48:
    case 0x49:
    case 0x4A:
    case 0x4B:
      op.execute = exec::long_halfwords;
      return;
    case 0x4C:
    case 0x4D:
    case 0x5C:
    case 0x5D:
      op.execute = exec::dual_multiply_long;
      return;
    case 0x60:
      op.execute = exec::unsigned_long_accumulate;
      return;
    case 0x66:
      op.execute = exec::unsigned_long_double_accumulate;
      return;
    default:
      return;
  }
}

}  // namespace rotorloop::mcu
