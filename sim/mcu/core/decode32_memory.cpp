// 32-bit loads and stores: single (A5.3.7 to A5.3.10), multiple (A5.3.5), dual, exclusive and table branches (A5.3.6).
#include <bit>

#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"
#include "sim/mcu/core/state.hpp"

namespace rotorloop::mcu {
namespace {

uint8_t register_at(uint32_t word, uint32_t lowest) { return static_cast<uint8_t>(word >> lowest & 15); }

enum Mode : uint8_t { kOffset, kPre, kPost, kRegister };

#define RL_MCU_MODES(NAME) \
  { exec::NAME##_offset, exec::NAME##_pre, exec::NAME##_post, exec::NAME##_register }
constexpr Execute kTransfers[9][4] = {RL_MCU_MODES(strb),  RL_MCU_MODES(strh),  RL_MCU_MODES(str),
                                      RL_MCU_MODES(ldrb),  RL_MCU_MODES(ldrh),  RL_MCU_MODES(ldr),
                                      RL_MCU_MODES(ldrsb), RL_MCU_MODES(ldrsh), RL_MCU_MODES(load_pc)};
#undef RL_MCU_MODES

// Addressing of a single transfer; false: undefined.
bool addressing(Op& op, uint32_t first, uint32_t second, Mode& mode, bool& unprivileged) {
  if ((first & 0x80) != 0) {
    op.imm = second & 0xFFF;
    return true;
  }
  if ((second & 0x800) == 0) {
    mode = kRegister;
    op.rm = register_at(second, 0);
    op.kind = static_cast<uint8_t>(second >> 4 & 3);
    return (second & 0xFC0) == 0;
  }
  const bool pre = (second & 0x400) != 0, add = (second & 0x200) != 0, write_back = (second & 0x100) != 0;
  op.imm = add ? second & 0xFF : 0u - (second & 0xFF);
  unprivileged = pre && add && !write_back;
  mode = !write_back ? kOffset : pre ? kPre : kPost;
  return pre || write_back;
}

}  // namespace

void decode_single_transfer(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  const uint32_t size = first >> 5 & 3;
  const bool load = (first & 0x10) != 0, is_signed = (first & 0x100) != 0;
  op.execute = exec::undefined;
  op.rd = register_at(second, 12);
  op.rn = register_at(first, 0);
  if (size == 3 || (is_signed && (!load || size == 2))) return;
  Mode mode = kOffset;
  bool unprivileged = false;
  if (load && op.rn == kPc) {
    const uint32_t here = (address + 4) & ~3u, offset = second & 0xFFF;
    op.imm = (first & 0x80) != 0 ? here + offset : here - offset;
    op.rn = kZero;
  } else if (!addressing(op, first, second, mode, unprivileged) || (!load && op.rn == kPc)) {
    return;
  }
  if (load && op.rd == kPc && size != 2) {  // PLD, PLI and unallocated hints
    op.execute = exec::nop;
    return;
  }
  op.cycles = load ? cost::kLoad : cost::kStore;
  if (unprivileged) {
    op.kind = static_cast<uint8_t>(1u << size | (is_signed ? 8u : 0u) | (load ? 0u : 16u));
    op.execute = exec::transfer_unprivileged;
    return;
  }
  const bool to_pc = load && op.rd == kPc;
  if (to_pc) op.cycles = cost::kLoadPc;
  op.execute = kTransfers[to_pc ? 8 : is_signed ? 6 + size : load ? 3 + size : size][mode];
}

void decode_multiple(Op& op, uint32_t first, uint32_t second) {
  const uint32_t direction = first >> 7 & 3;
  const bool load = (first & 0x10) != 0;
  op.rn = register_at(first, 0);
  op.imm = second;
  op.kind = static_cast<uint8_t>((first >> 5 & 1) | (direction == 2 ? 2 : 0));
  op.execute = direction == 0 || direction == 3 ? exec::undefined : load ? exec::load_multiple : exec::store_multiple;
  const auto words = static_cast<uint32_t>(std::popcount(second));
  op.cycles = static_cast<uint8_t>(cost::multiple(words) + (load && (second & 0x8000) != 0 ? cost::kRefill : 0));
}

namespace {

void exclusive_or_table(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  const uint32_t which = second >> 4 & 15;
  const bool load = (first & 0x10) != 0;
  op.execute = exec::undefined;
  op.cycles = cost::kExclusive;
  if (load && which < 2) {
    op.rm = register_at(second, 0);
    op.kind = static_cast<uint8_t>(which);
    op.imm = address + 4;
    op.execute = exec::table_branch;
    op.cycles = cost::kTableBranch;
  } else if (which == 4 || which == 5) {
    op.kind = static_cast<uint8_t>(which - 3);
    op.rd = load ? register_at(second, 12) : register_at(second, 0);
    op.rm = register_at(second, 12);
    op.execute = load ? exec::load_exclusive : exec::store_exclusive;
  }
}

}  // namespace

void decode_dual_exclusive_table(Op& op, uint32_t first, uint32_t second, uint32_t address) {
  const bool pre = (first & 0x100) != 0, add = (first & 0x80) != 0, write_back = (first & 0x20) != 0, load = (first & 0x10) != 0;
  op.rn = register_at(first, 0);
  op.imm = (second & 0xFF) * 4;
  if (!pre && !write_back) {
    if (add) {
      op.imm = 0;
      exclusive_or_table(op, first, second, address);
      return;
    }
    op.kind = 4;
    op.cycles = cost::kExclusive;
    op.rd = load ? register_at(second, 12) : register_at(second, 8);
    op.rm = register_at(second, 12);
    op.execute = load ? exec::load_exclusive : exec::store_exclusive;
    return;
  }
  op.rd = register_at(second, 12);
  op.rm = register_at(second, 8);
  if (!add) op.imm = 0u - op.imm;
  op.kind = !write_back ? kOffset : pre ? kPre : kPost;
  op.execute = load ? exec::load_double : exec::store_double;
  op.cycles = cost::kDual;
  if (op.rn == kPc) {
    op.imm += (address + 4) & ~3u;
    op.rn = kZero;
  }
}

}  // namespace rotorloop::mcu
