// 32-bit instructions: the table of A5.3, data processing with constants, branches and control.
#include <bit>

#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"
#include "sim/mcu/core/state.hpp"

namespace rotorloop::mcu {
namespace {

uint8_t bits4(uint32_t word, uint32_t lowest) { return static_cast<uint8_t>(word >> lowest & 15); }

// ThumbExpandImm_C: the constant, and its carry out of bit 31 or 2 where the carry stays (A5.3.2).
uint32_t expand_immediate(uint32_t imm12, uint8_t& carry) {
  const uint32_t byte = imm12 & 0xFF;
  carry = 2;
  if (imm12 >> 10 == 0) {
    switch (imm12 >> 8) {
      case 0:
        return byte;
      case 1:
        return byte << 16 | byte;
      case 2:
        return byte << 24 | byte << 8;
      default:
        return byte * 0x01010101u;
    }
  }
  const uint32_t value = std::rotr(0x80u | (imm12 & 0x7F), static_cast<int>(imm12 >> 7));
  carry = static_cast<uint8_t>(value >> 31);
  return value;
}

// Data processing by its four bits of operation; MOV and MVN are ORR and ORN of zero, and four compare when Rd is the PC.
void set_operation(Op& op, uint32_t operation, bool flags, Form form, uint8_t rd, uint8_t rn) {
  static constexpr int8_t kAlu[16] = {0, 1, 2, 3, 4, -1, -1, -1, 5, -1, 6, 7, -1, 8, 9, -1};
  if (kAlu[operation] < 0) {
    op.execute = exec::undefined;
    return;
  }
  const auto which = static_cast<Alu>(kAlu[operation]);
  const bool compares = which == Alu::bit_and || which == Alu::bit_xor || which == Alu::add || which == Alu::sub;
  op.rd = rd == kPc && flags && compares ? static_cast<uint8_t>(kNowhere) : rd;
  op.rn = rn == kPc && (which == Alu::bit_or || which == Alu::bit_or_not) ? static_cast<uint8_t>(kZero) : rn;
  op.execute = alu(which, flags, form, op.rd);
}

void saturate(Op& op, uint32_t first, uint32_t second, uint32_t shift) {
  const bool is_unsigned = (first & 0x80) != 0, arithmetic = (first & 0x20) != 0;
  const bool halfwords = arithmetic && shift == 0;
  op.kind = arithmetic ? kAsr : kLsl;
  op.extra = static_cast<uint8_t>((second & 31) + (is_unsigned ? 0 : 1));
  op.imm = shift;
  op.rm = op.rn;
  if (halfwords)
    op.execute = is_unsigned ? exec::unsigned_saturate16 : exec::signed_saturate16;
  else
    op.execute = is_unsigned ? exec::unsigned_saturate : exec::signed_saturate;
}

// A constant of 12 or 16 bits, bit fields, saturation (A5.3.3).
void plain_immediate(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  const uint32_t imm12 = (first & 0x400) << 1 | (second >> 4 & 0x700) | (second & 0xFF);
  const uint32_t imm16 = (first & 15) << 12 | imm12, low_bit = (second >> 10 & 0x1C) | (second >> 6 & 3), width = second & 31;
  op.rd = bits4(second, 8);
  op.rn = bits4(first, 0);
  op.imm = imm12;
  switch (first >> 4 & 31) {
    case 0:
    case 10: {
      const bool subtract = (first >> 4 & 31) == 10;
      op.execute = alu(subtract ? Alu::sub : Alu::add, false, Form::immediate, op.rd);
      if (op.rn != kPc) return;
      op.rn = kZero;  // ADR
      const uint32_t here = (address + 4) & ~3u;
      op.imm = subtract ? here - imm12 : here + imm12;
      op.execute = alu(Alu::add, false, Form::immediate, op.rd);
      return;
    }
    case 4:
      op.imm = imm16;
      op.rn = kZero;
      op.execute = alu(Alu::add, false, Form::immediate, op.rd);
      return;
    case 12:
      op.imm = imm16;
      op.execute = exec::move_top;
      return;
    case 16:
    case 18:
    case 24:
    case 26:
      saturate(op, first, second, low_bit);
      return;
    case 20:
    case 28:
      op.execute = (first & 0x80) != 0 ? exec::bit_field_extract : exec::signed_bit_field_extract;
      if (low_bit + width > 31) op.execute = exec::undefined;  // unpredictable: the field leaves the word
      op.kind = static_cast<uint8_t>(low_bit);
      op.extra = static_cast<uint8_t>(width + 1);
      return;
    case 22:
      if (op.rn == kPc) op.rn = kZero;  // BFC
      op.execute = width < low_bit ? exec::undefined : exec::bit_field_insert;
      op.kind = static_cast<uint8_t>(low_bit);
      op.extra = static_cast<uint8_t>(width + 1 - low_bit);
      return;
    default:
      op.execute = exec::undefined;
      return;
  }
}

uint32_t long_branch_offset(uint32_t first, uint32_t second) {
  const uint32_t s = first >> 10 & 1, i1 = ((second >> 13 & 1) ^ s) ^ 1, i2 = ((second >> 11 & 1) ^ s) ^ 1;
  const uint32_t offset = s << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
  return static_cast<uint32_t>(static_cast<int32_t>(offset << 7) >> 7);
}

uint32_t conditional_branch_offset(uint32_t first, uint32_t second) {
  const uint32_t offset =
      (first >> 10 & 1) << 20 | (second >> 11 & 1) << 19 | (second >> 13 & 1) << 18 | (first & 0x3F) << 12 | (second & 0x7FF) << 1;
  return static_cast<uint32_t>(static_cast<int32_t>(offset << 11) >> 11);
}

// MSR, MRS, hints and barriers.
void control(Op& op, uint32_t first, uint32_t second) {
  op.imm = second & 0xFF;
  switch (first >> 4 & 0x7F) {
    case 0x38:
    case 0x39:
      op.rn = bits4(first, 0);
      op.kind = static_cast<uint8_t>(second >> 10 & 3);
      op.execute = exec::write_special;
      op.cycles = cost::kSpecial;
      return;
    case 0x3A: {
      static constexpr Execute kHints[5] = {exec::nop, exec::nop, exec::wait_for_event, exec::wait_for_interrupt, exec::send_event};
      op.execute = (second & 0x700) != 0 ? exec::undefined : op.imm < 5 ? kHints[op.imm] : exec::nop;
      return;
    }
    case 0x3B: {
      const uint32_t which = second >> 4 & 15;
      op.execute = which == 2 ? exec::clear_exclusive : which >= 4 && which <= 6 ? exec::barrier : exec::undefined;
      return;
    }
    case 0x3E:
    case 0x3F:
      op.rd = bits4(second, 8);
      op.execute = exec::read_special;
      op.cycles = cost::kSpecial;
      return;
    default:
      op.execute = exec::undefined;
      return;
  }
}

}  // namespace

void decode_immediate(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  if ((first & 0x200) != 0) {
    plain_immediate(op, first, second, address);
    return;
  }
  const uint32_t imm12 = (first & 0x400) << 1 | (second >> 4 & 0x700) | (second & 0xFF);
  op.imm = expand_immediate(imm12, op.extra);
  set_operation(op, first >> 5 & 15, (first & 0x10) != 0, Form::immediate, bits4(second, 8), bits4(first, 0));
}

void decode_shifted_register(Op& op, uint32_t first, uint32_t second) {
  const uint32_t operation = first >> 5 & 15, amount = (second >> 10 & 0x1C) | (second >> 6 & 3);
  op.kind = static_cast<uint8_t>(second >> 4 & 3);
  op.imm = amount;
  op.rm = bits4(second, 0);
  if (amount == 0 && op.kind == kRor) op.kind = kRrx;
  if (amount == 0 && (op.kind == kLsr || op.kind == kAsr)) op.imm = 32;
  if (operation == 6) {
    op.rd = bits4(second, 8);
    op.rn = bits4(first, 0);
    op.execute = (first & 0x10) != 0 || (second & 0x10) != 0 ? exec::undefined : exec::pack;
    return;
  }
  const bool plain = op.kind == kLsl && amount == 0;
  set_operation(op, operation, (first & 0x10) != 0, plain ? Form::plain : Form::shifted, bits4(second, 8), bits4(first, 0));
}

void decode_branch_and_control(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  const uint32_t kind = second >> 12 & 5;
  op.cycles = cost::kBranch;
  if (kind == 1 || kind == 5) {
    op.imm = address + 4 + long_branch_offset(first, second);
    op.execute = kind == 1 ? exec::branch_to : exec::branch_link;
    return;
  }
  op.cycles = cost::kOne;
  if (kind == 4) {  // BLX to Arm code, and UDF
    op.execute = exec::undefined;
    return;
  }
  if ((first >> 7 & 7) == 7) {
    control(op, first, second);
    return;
  }
  op.imm = address + 4 + conditional_branch_offset(first, second);
  op.kind = bits4(first, 6);
  op.execute = exec::branch_if;
}

void decode32(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  op.bytes = 4;
  const uint32_t group = first >> 11 & 3, kind = first >> 4 & 0x7F;
  if (group == 2) {
    if ((second & 0x8000) != 0)
      decode_branch_and_control(op, first, second, address);
    else
      decode_immediate(op, first, second, address);
  } else if ((kind & 0x40) != 0) {
    decode_coprocessor(op, first, second, address);
  } else if (group == 1) {
    if ((kind & 0x20) != 0)
      decode_shifted_register(op, first, second);
    else if ((kind & 4) != 0)
      decode_dual_exclusive_table(op, first, second, address);
    else
      decode_multiple(op, first, second);
  } else if ((kind & 0x20) == 0) {
    decode_single_transfer(op, first, second, address);
  } else if ((kind & 0x10) == 0) {
    decode_register(op, first, second);
  } else {
    (kind & 8) == 0 ? decode_multiply(op, first, second) : decode_long_multiply(op, first, second);
  }
}

}  // namespace rotorloop::mcu
