// What executes an instruction, by group; decode*.cpp choose. Operands are those of Op, unless a comment says otherwise.
#pragma once
#include "sim/mcu/core/op.hpp"

namespace rotorloop::mcu {

enum class Alu : uint8_t { bit_and, bit_clear, bit_or, bit_or_not, bit_xor, add, add_carry, sub_carry, sub, reverse_sub };
// Second operand: imm (extra: carry out of the expansion, 2 where it stays), rm, or rm shifted by `imm` with the type in `kind`.
enum class Form : uint8_t { immediate, plain, shifted };
Execute alu(Alu operation, bool flags, Form form, uint32_t rd);
enum Shift : uint8_t { kLsl = 0, kLsr = 1, kAsr = 2, kRor = 3, kRrx = 4 };

namespace exec {
using Handler = void(Core&, const Op&);
// Data (exec_data.cpp)
Handler undefined, nop, move_top, shift_by_register, shift_by_register_flags, add_to_pc, move_to_pc;
Handler clz, rbit, rev, rev16, revsh, bit_field_insert, bit_field_extract, signed_bit_field_extract;
Handler extend;  // kind: 0 SXTB 1 SXTH 2 UXTB 3 UXTH 4 SXTB16 5 UXTB16; imm: rotation; rn: what is added
Handler pack, select_bytes, signed_saturate, unsigned_saturate, signed_saturate16, unsigned_saturate16;
// DSP (exec_dsp.cpp): kind: 0 ADD8 1 ADD16 2 ASX 4 SUB8 5 SUB16 6 SAX
Handler signed_parallel, saturating_parallel, signed_halving, unsigned_parallel, unsigned_saturating, unsigned_halving;
Handler saturating_add;  // kind: 0 QADD 1 QDADD 2 QSUB 3 QDSUB
Handler absolute_differences;
// Multiply (exec_multiply.cpp)
Handler multiply, multiply_flags, multiply_accumulate, multiply_subtract, unsigned_long, signed_long, unsigned_long_accumulate;
Handler signed_long_accumulate, unsigned_long_double_accumulate, signed_divide, unsigned_divide;
Handler multiply_halfwords, multiply_word_halfword, dual_multiply, dual_multiply_long, long_halfwords, most_significant;
// Memory (exec_memory.cpp); imm: offset. _pre and _post write rn back, _register adds rm shifted left by kind.
#define RL_MCU_TRANSFERS(X) X(ldr) X(ldrb) X(ldrh) X(ldrsb) X(ldrsh) X(str) X(strb) X(strh)
#define X(NAME) Handler NAME##_offset, NAME##_pre, NAME##_post, NAME##_register;
RL_MCU_TRANSFERS(X)
#undef X
Handler load_pc_offset, load_pc_pre, load_pc_post, load_pc_register, load_literal;
Handler transfer_unprivileged;            // kind: bytes, bit 3 signed, bit 4 store
Handler load_double, store_double;        // rd, rm; kind: 0 offset 1 pre 2 post
Handler load_multiple, store_multiple;    // imm: list; kind: bit 0 write back, bit 1 decrement before
Handler load_exclusive, store_exclusive;  // kind: bytes; store: rd result, rm value
Handler clear_exclusive;
// Branches and system (exec_system.cpp)
Handler branch_to, branch_if, branch_link, branch_exchange, branch_link_exchange, branch_if_zero, branch_if_nonzero, table_branch;
Handler if_then, supervisor_call, change_state, read_special, write_special, wait_for_interrupt, wait_for_event, send_event, barrier,
    breakpoint;
// Floating point (exec_fp.cpp, exec_fp_transfer.cpp): rd, rn, rm are numbers of S registers
Handler vadd, vsub, vmul, vnmul, vmla, vmls, vnmla, vnmls, vfma, vfms, vfnma, vfnms, vdiv, vsqrt, vabs, vneg, vmov, vmov_imm;
Handler vcmp, vcmp_zero;  // kind: 1 for VCMPE
Handler vcvt_from_int;    // kind: 1 signed
Handler vcvt_to_int;      // kind: bit 0 signed, bit 1 rounding of FPSCR instead of toward zero
Handler vcvt_fixed;       // kind: bit 0 unsigned, bit 1 32 bits, bit 2 to fixed; imm: fraction bits
Handler vcvt_half;        // kind: bit 0 top half, bit 1 to half
Handler vmov_to_s, vmov_from_s, vmov_two_to_s, vmov_two_from_s, vmrs, vmsr, vldr, vstr, vload_multiple, vstore_multiple;
Handler no_coprocessor;
}  // namespace exec

}  // namespace rotorloop::mcu
