// 16-bit instructions (A5.2), by their top five bits.
#include <bit>

#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"
#include "sim/mcu/core/state.hpp"

namespace rotorloop::mcu {
namespace {

struct Thumb {
  uint32_t code, address;
  bool flags;  // outside of an IT block
  uint8_t low(uint32_t bit) const { return static_cast<uint8_t>(code >> bit & 7); }
  uint32_t imm5() const { return code >> 6 & 31; }
  uint32_t imm8() const { return code & 0xFF; }
};

void set_alu(Op& op, Alu operation, bool flags, Form form, uint8_t rd, uint8_t rn) {
  op.execute = alu(operation, flags, form, rd);
  op.rd = rd;
  op.rn = rn;
}

// LSL, LSR, ASR by a constant; add, subtract, move, compare with a constant (A5.2.1).
void shift_add_move(Op& op, const Thumb& t) {
  const uint8_t rd8 = t.low(8);
  op.imm = t.imm8();
  switch (t.code >> 11) {
    case 0:
    case 1:
    case 2: {
      op.kind = static_cast<uint8_t>(t.code >> 11);
      op.rm = t.low(3);
      op.imm = t.imm5() == 0 && op.kind != kLsl ? 32 : t.imm5();
      set_alu(op, Alu::bit_or, t.flags, op.imm == 0 ? Form::plain : Form::shifted, t.low(0), kZero);
      return;
    }
    case 3: {
      const bool immediate = (t.code & 0x400) != 0;
      op.imm = op.rm = t.low(6);
      set_alu(op, (t.code & 0x200) != 0 ? Alu::sub : Alu::add, t.flags, immediate ? Form::immediate : Form::plain, t.low(0), t.low(3));
      return;
    }
    case 4:
      op.extra = 2;
      set_alu(op, Alu::bit_or, t.flags, Form::immediate, rd8, kZero);
      return;
    case 5:
      set_alu(op, Alu::sub, true, Form::immediate, kNowhere, rd8);
      return;
    case 6:
      set_alu(op, Alu::add, t.flags, Form::immediate, rd8, rd8);
      return;
    default:
      set_alu(op, Alu::sub, t.flags, Form::immediate, rd8, rd8);
      return;
  }
}

// Data processing with two low registers (A5.2.2).
void data_processing(Op& op, const Thumb& t) {
  const uint8_t rd = t.low(0), rm = t.low(3);
  const uint32_t which = t.code >> 6 & 15;
  op.rm = rm;
  op.rd = op.rn = rd;
  switch (which) {
    case 2:
    case 3:
    case 4:
    case 7: {
      op.kind = static_cast<uint8_t>(which == 7 ? uint32_t{kRor} : which - 2);
      op.execute = t.flags ? exec::shift_by_register_flags : exec::shift_by_register;
      return;
    }
    case 8:
    case 10:
    case 11: {  // TST, CMP, CMN
      static constexpr Alu kCompare[4] = {Alu::bit_and, Alu::bit_and, Alu::sub, Alu::add};
      set_alu(op, kCompare[which - 8], true, Form::plain, kNowhere, rd);
      return;
    }
    case 9:  // RSB from zero
      op.imm = 0;
      set_alu(op, Alu::reverse_sub, t.flags, Form::immediate, rd, rm);
      return;
    case 13:
      op.execute = t.flags ? exec::multiply_flags : exec::multiply;
      return;
    default: {
      static constexpr Alu kAlu[16] = {Alu::bit_and, Alu::bit_xor, {}, {},          {}, Alu::add_carry, Alu::sub_carry, {}, {},
                                       {},           {},           {}, Alu::bit_or, {}, Alu::bit_clear, Alu::bit_or_not};
      set_alu(op, kAlu[which], t.flags, Form::plain, rd, which == 15 ? kZero : rd);
    }
  }
}

// Any of the sixteen registers; BX and BLX (A5.2.3).
void high_registers(Op& op, const Thumb& t) {
  const auto rd = static_cast<uint8_t>((t.code & 7) | (t.code >> 4 & 8));
  op.rd = rd;
  op.rm = static_cast<uint8_t>(t.code >> 3 & 15);
  op.imm = t.address + 4;
  switch (t.code >> 8 & 3) {
    case 0:
      if (rd == kPc) {
        op.execute = exec::add_to_pc;
        op.cycles = cost::kBranch;
      } else if (op.rm == kPc) {
        set_alu(op, Alu::add, false, Form::immediate, rd, rd);
      } else {
        set_alu(op, Alu::add, false, Form::plain, rd, rd);
      }
      return;
    case 1:
      set_alu(op, Alu::sub, true, Form::plain, kNowhere, rd);
      return;
    case 2:
      if (rd == kPc) {
        op.execute = exec::move_to_pc;
        op.cycles = cost::kBranch;
      } else if (op.rm == kPc) {
        op.extra = 2;
        set_alu(op, Alu::bit_or, false, Form::immediate, rd, kZero);
      } else {
        set_alu(op, Alu::bit_or, false, Form::plain, rd, kZero);
      }
      return;
    default:
      op.execute = (t.code & 0x80) != 0 ? exec::branch_link_exchange : exec::branch_exchange;
      op.cycles = cost::kBranch;
  }
}

void set_load(Op& op, Execute execute, uint8_t rd, uint8_t rn, uint32_t imm) {
  op.execute = execute;
  op.rd = rd;
  op.rn = rn;
  op.imm = imm;
  op.cycles = cost::kLoad;
}
void set_store(Op& op, Execute execute, uint8_t rd, uint8_t rn, uint32_t imm) {
  set_load(op, execute, rd, rn, imm);
  op.cycles = cost::kStore;
}

// Loads and stores of one register (A5.2.4).
void transfer(Op& op, const Thumb& t) {
  const uint8_t rd = t.low(0), rn = t.low(3);
  const uint32_t imm5 = t.imm5();
  switch (t.code >> 11) {
    case 10:
    case 11: {
      static constexpr Execute kByRegister[8] = {exec::str_register, exec::strh_register, exec::strb_register, exec::ldrsb_register,
                                                 exec::ldr_register, exec::ldrh_register, exec::ldrb_register, exec::ldrsh_register};
      const uint32_t which = t.code >> 9 & 7;
      set_load(op, kByRegister[which], rd, rn, 0);
      op.rm = t.low(6);
      op.cycles = which < 3 ? cost::kStore : cost::kLoad;
      return;
    }
    case 12:
      set_store(op, exec::str_offset, rd, rn, imm5 * 4);
      return;
    case 13:
      set_load(op, exec::ldr_offset, rd, rn, imm5 * 4);
      return;
    case 14:
      set_store(op, exec::strb_offset, rd, rn, imm5);
      return;
    case 15:
      set_load(op, exec::ldrb_offset, rd, rn, imm5);
      return;
    case 16:
      set_store(op, exec::strh_offset, rd, rn, imm5 * 2);
      return;
    case 17:
      set_load(op, exec::ldrh_offset, rd, rn, imm5 * 2);
      return;
    case 18:
      set_store(op, exec::str_offset, t.low(8), kSp, t.imm8() * 4);
      return;
    default:
      set_load(op, exec::ldr_offset, t.low(8), kSp, t.imm8() * 4);
      return;
  }
}

void set_multiple(Op& op, bool load, uint8_t rn, uint32_t list, uint8_t kind) {
  op.execute = load ? exec::load_multiple : exec::store_multiple;
  op.rn = rn;
  op.imm = list;
  op.kind = kind;
  const auto words = static_cast<uint32_t>(std::popcount(list));
  op.cycles = static_cast<uint8_t>(cost::multiple(words) + ((list & 0x8000) != 0 ? cost::kRefill : 0));
}

void hints_and_it(Op& op, const Thumb& t) {
  if ((t.code & 15) != 0) {
    op.execute = exec::if_then;
    op.imm = t.code & 0xFF;
    return;
  }
  static constexpr Execute kHints[5] = {exec::nop, exec::nop, exec::wait_for_event, exec::wait_for_interrupt, exec::send_event};
  const uint32_t hint = t.code >> 4 & 15;
  op.execute = hint < 5 ? kHints[hint] : exec::nop;
}

void reverse(Op& op, const Thumb& t) {
  static constexpr Execute kReverse[4] = {exec::rev, exec::rev16, exec::undefined, exec::revsh};
  op.rd = t.low(0);
  op.rm = t.low(3);
  op.execute = kReverse[t.code >> 6 & 3];
}

// Miscellaneous (A5.2.5).
void miscellaneous(Op& op, const Thumb& t) {
  switch (t.code >> 8 & 15) {
    case 0:
      op.imm = (t.code & 0x7F) * 4;
      set_alu(op, (t.code & 0x80) != 0 ? Alu::sub : Alu::add, false, Form::immediate, kSp, kSp);
      return;
    case 1:
    case 3:
    case 9:
    case 11:
      op.rn = t.low(0);
      op.imm = t.address + 4 + ((t.code >> 2 & 0x3E) | (t.code >> 3 & 0x40));
      op.execute = (t.code & 0x800) != 0 ? exec::branch_if_nonzero : exec::branch_if_zero;
      return;
    case 2: {
      static constexpr uint8_t kKind[4] = {1, 0, 3, 2};
      op.rd = t.low(0);
      op.rm = t.low(3);
      op.rn = kZero;
      op.kind = kKind[t.code >> 6 & 3];
      op.execute = exec::extend;
      return;
    }
    case 4:
    case 5:
      set_multiple(op, false, kSp, (t.code & 0xFF) | (t.code & 0x100) << 6, 3);
      return;
    case 6:
      op.imm = t.code & 0x13;
      op.execute = (t.code & 0xE8) == 0x60 ? exec::change_state : exec::undefined;
      return;
    case 10:
      reverse(op, t);
      return;
    case 12:
    case 13:
      set_multiple(op, true, kSp, (t.code & 0xFF) | (t.code & 0x100) << 7, 1);
      return;
    case 14:
      op.imm = t.imm8();
      op.execute = exec::breakpoint;
      return;
    case 15:
      hints_and_it(op, t);
      return;
    default:
      op.execute = exec::undefined;
      return;
  }
}

uint32_t sign_extended(uint32_t value, uint32_t bits) {
  return static_cast<uint32_t>(static_cast<int32_t>(value << (32 - bits)) >> (32 - bits));
}

void conditional_branch(Op& op, const Thumb& t) {
  const uint32_t condition = t.code >> 8 & 15;
  op.imm = t.address + 4 + sign_extended(t.imm8() << 1, 9);
  op.kind = static_cast<uint8_t>(condition);
  op.execute = condition == 14 ? exec::undefined : condition == 15 ? exec::supervisor_call : exec::branch_if;
  if (condition == 15) op.imm = t.imm8();
}

}  // namespace

void decode16(Op& op, uint32_t code, uint32_t address, bool in_it) {
  const Thumb t{code, address, !in_it};
  const uint32_t list = t.imm8();
  switch (code >> 11) {
    case 8:
      if (code < 0x4400)
        data_processing(op, t);
      else
        high_registers(op, t);
      return;
    case 9:
      set_load(op, exec::load_literal, t.low(8), kZero, ((address + 4) & ~3u) + t.imm8() * 4);
      return;
    case 20:
      op.extra = 2;
      op.imm = ((address + 4) & ~3u) + t.imm8() * 4;
      set_alu(op, Alu::bit_or, false, Form::immediate, t.low(8), kZero);
      return;
    case 21:
      op.imm = t.imm8() * 4;
      set_alu(op, Alu::add, false, Form::immediate, t.low(8), kSp);
      return;
    case 22:
    case 23:
      miscellaneous(op, t);
      return;
    case 24:
      set_multiple(op, false, t.low(8), list, 1);
      return;
    case 25:
      set_multiple(op, true, t.low(8), list, (list >> t.low(8) & 1) != 0 ? 0 : 1);
      return;
    case 26:
    case 27:
      conditional_branch(op, t);
      return;
    case 28:
      op.imm = address + 4 + sign_extended((code & 0x7FF) << 1, 12);
      op.execute = exec::branch_to;
      op.cycles = cost::kBranch;
      return;
    default:
      if (code >> 11 < 8)
        shift_add_move(op, t);
      else
        transfer(op, t);
  }
}

}  // namespace rotorloop::mcu
