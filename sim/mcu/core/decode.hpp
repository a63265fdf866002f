// From two halfwords to a decoded instruction. Encodings: ARMv7-M Architecture Reference Manual, chapters A5 and A7; the section of each
// table stands at its function.
#pragma once
#include <cstdint>

#include "sim/mcu/core/op.hpp"

namespace rotorloop::mcu {

// in_it: 16-bit instructions do not set flags there. address: of the instruction, for those that use the PC.
void decode16(Op& op, uint32_t code, uint32_t address, bool in_it);
void decode32(Op& op, uint32_t first, uint32_t second, uint32_t address);
// Parts of decode32, each for what its name says.
void decode_multiple(Op& op, uint32_t first, uint32_t second);
void decode_dual_exclusive_table(Op& op, uint32_t first, uint32_t second, uint32_t address);
void decode_shifted_register(Op& op, uint32_t first, uint32_t second);
void decode_immediate(Op& op, uint32_t first, uint32_t second, uint32_t address);
void decode_branch_and_control(Op& op, uint32_t first, uint32_t second, uint32_t address);
void decode_single_transfer(Op& op, uint32_t first, uint32_t second, uint32_t address);
void decode_register(Op& op, uint32_t first, uint32_t second);
void decode_multiply(Op& op, uint32_t first, uint32_t second);
void decode_long_multiply(Op& op, uint32_t first, uint32_t second);
void decode_coprocessor(Op& op, uint32_t first, uint32_t second, uint32_t address);

// BKPT: the one instruction that executes in an IT block whatever its condition.
Execute exec_always();

}  // namespace rotorloop::mcu
