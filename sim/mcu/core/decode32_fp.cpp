// Floating-point instructions (A6.4 to A6.7) and the coprocessor space around them.
#include <bit>

#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"
#include "sim/mcu/core/state.hpp"

namespace rotorloop::mcu {
namespace {

uint8_t single(uint32_t four, uint32_t low_bit) { return static_cast<uint8_t>((four & 15) << 1 | (low_bit & 1)); }

// VFPExpandImm for single precision (A6.4.1).
uint32_t expand_fp_immediate(uint32_t imm8) {
  const uint32_t exponent = (imm8 & 0x40) != 0 ? 0x7Cu : 0x80u;
  return (imm8 & 0x80) << 24 | (exponent | (imm8 >> 4 & 3)) << 23 | (imm8 & 15) << 19;
}

void fixed_point(Op& op, uint32_t which, uint32_t second) {
  const uint32_t size = (second & 0x80) != 0 ? 32 : 16, fraction = (second & 15) << 1 | (second >> 5 & 1);
  op.kind = static_cast<uint8_t>((which & 1) | (size == 32 ? 2 : 0) | (which & 4));
  op.imm = size - fraction;
  op.execute = fraction > size ? exec::no_coprocessor : exec::vcvt_fixed;
}

// The extension instructions: one or two operands, conversions (A6-4).
void other_operation(Op& op, uint32_t first, uint32_t second) {
  const uint32_t which = first & 15;
  const bool top = (second & 0x80) != 0;
  if ((second & 0x40) == 0) {
    op.imm = expand_fp_immediate(which << 4 | (second & 15));
    op.execute = (second & 0xA0) == 0 ? exec::vmov_imm : exec::no_coprocessor;
    return;
  }
  switch (which) {
    case 0:
      op.execute = top ? exec::vabs : exec::vmov;
      return;
    case 1:
      op.execute = top ? exec::vsqrt : exec::vneg;
      if (top) op.cycles = cost::kVsqrt;
      return;
    case 2:
    case 3:
      op.execute = exec::vcvt_half;
      op.kind = static_cast<uint8_t>((top ? 1 : 0) | (which & 1) << 1);
      return;
    case 4:
    case 5:
      op.execute = which == 4 ? exec::vcmp : exec::vcmp_zero;
      op.kind = top ? 1 : 0;
      return;
    case 8:
      op.execute = exec::vcvt_from_int;
      op.kind = top ? 1 : 0;
      return;
    case 12:
    case 13:
      op.execute = exec::vcvt_to_int;
      op.kind = static_cast<uint8_t>((which & 1) | (top ? 0 : 2));
      return;
    case 10:
    case 11:
    case 14:
    case 15:
      fixed_point(op, which, second);
      return;
    default:
      return;
  }
}

void fp_data_processing(Op& op, uint32_t first, uint32_t second) {
  const bool second_kind = (second & 0x40) != 0;
  op.rd = single(second >> 12, first >> 6);
  op.rn = single(first, second >> 7);
  op.rm = single(second, second >> 5);
  if ((second & 0x100) != 0) return;  // double precision
  switch (first >> 4 & 0xB) {
    case 0:
      op.execute = second_kind ? exec::vmls : exec::vmla;
      break;
    case 1:
      op.execute = second_kind ? exec::vnmla : exec::vnmls;
      break;
    case 2:
      op.execute = second_kind ? exec::vnmul : exec::vmul;
      return;
    case 3:
      op.execute = second_kind ? exec::vsub : exec::vadd;
      return;
    case 8:
      if (second_kind) return;
      op.execute = exec::vdiv;
      op.cycles = cost::kVdiv;
      return;
    case 9:
      op.execute = second_kind ? exec::vfnma : exec::vfnms;
      break;
    case 10:
      op.execute = second_kind ? exec::vfms : exec::vfma;
      break;
    default:
      other_operation(op, first, second);
      return;
  }
  op.cycles = cost::kVfpMultiplyAccumulate;
}

// Between one core register and one S register, half of a D register, or FPSCR (A6.6).
void one_register(Op& op, uint32_t first, uint32_t second) {
  const bool to_core = (first & 0x10) != 0;
  const uint32_t which = first >> 5 & 7;
  op.rd = static_cast<uint8_t>(second >> 12 & 15);
  if ((second & 0x100) != 0) {
    if (which > 1 || (second & 0x60) != 0) return;
    op.rn = static_cast<uint8_t>(((second >> 7 & 1) << 4 | (first & 15)) * 2 + which);
    if (op.rn < 32) op.execute = to_core ? exec::vmov_from_s : exec::vmov_to_s;
  } else if (which == 0) {
    op.rn = single(first, second >> 7);
    op.execute = to_core ? exec::vmov_from_s : exec::vmov_to_s;
  } else if (which == 7 && (first & 15) == 1) {
    op.execute = to_core ? exec::vmrs : exec::vmsr;
  }
}

// Loads and stores, and two core registers with two S registers (A6.5, A6.7).
void fp_transfer(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  const bool doubles = (second & 0x100) != 0, load = (first & 0x10) != 0, pre = (first & 0x100) != 0, add = (first & 0x80) != 0,
             write_back = (first & 0x20) != 0;
  const uint32_t d = first >> 6 & 1, imm8 = second & 0xFF;
  op.rn = static_cast<uint8_t>(first & 15);
  op.rd = doubles ? static_cast<uint8_t>((d << 4 | second >> 12) << 1 & 0x3E) : single(second >> 12, d);
  if ((first & 0x1E0) == 0x040) {
    op.rd = static_cast<uint8_t>(second >> 12 & 15);
    op.ra = static_cast<uint8_t>(first & 15);
    op.rm = doubles ? static_cast<uint8_t>(((second >> 5 & 1) << 4 | (second & 15)) << 1) : single(second, second >> 5);
    op.cycles = cost::kVfpTwo;
    if ((second & 0xD0) == 0x10 && op.rm < 31) op.execute = load ? exec::vmov_two_from_s : exec::vmov_two_to_s;
    return;
  }
  if (pre && !write_back) {
    op.kind = doubles ? 1 : 0;
    op.imm = add ? imm8 * 4 : 0u - imm8 * 4;
    op.cycles = static_cast<uint8_t>(cost::kVfpLoad + (doubles ? 1 : 0));
    if (op.rn == kPc && load) {
      op.imm += (address + 4) & ~3u;
      op.rn = kZero;
    }
    if (op.rd + (doubles ? 1 : 0) < 32) op.execute = load ? exec::vldr : exec::vstr;
    return;
  }
  if (pre == add || imm8 == 0) return;
  op.imm = imm8;
  op.extra = doubles ? static_cast<uint8_t>(imm8 & ~1u) : static_cast<uint8_t>(imm8);
  op.kind = static_cast<uint8_t>((write_back ? 1 : 0) | (pre ? 2 : 0));
  op.cycles = cost::multiple(op.extra);
  if (op.rd + op.extra <= 32) op.execute = load ? exec::vload_multiple : exec::vstore_multiple;
}

}  // namespace

void decode_coprocessor(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  op.execute = exec::no_coprocessor;
  op.extra = 0;
  if ((second & 0xE00) != 0xA00) return;
  op.extra = 1;  // an encoding of the FPU that does not exist, unless one of these takes it
  if ((first & 0x1000) != 0 || (first & 0x300) == 0x300) return;
  if ((first & 0x200) == 0)
    fp_transfer(op, first, second, address);
  else if ((second & 0x10) != 0)
    one_register(op, first, second);
  else
    fp_data_processing(op, first, second);
  if (op.execute == exec::no_coprocessor) op.extra = 1;
}

}  // namespace rotorloop::mcu
