// Loads and stores. What faults leaves registers as they were: results and written-back bases come last.
#include <array>
#include <bit>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/handlers.hpp"

namespace rotorloop::mcu::exec {
namespace {

enum class How : uint8_t { offset, pre, post, by_register };

template <How kHow>
uint32_t address_of(const Core& core, const Op& op) {
  const uint32_t base = core.state.r[op.rn];
  if constexpr (kHow == How::post) return base;
  if constexpr (kHow == How::by_register) return base + (core.state.r[op.rm] << op.kind);
  return base + op.imm;
}

template <How kHow>
void write_back(Core& core, const Op& op) {
  if constexpr (kHow == How::pre || kHow == How::post) {
    const uint32_t moved = core.state.r[op.rn] + op.imm;
    core.state.r[op.rn] = op.rn == kSp ? moved & ~3u : moved;
  }
}

template <uint32_t kBytes, bool kSigned, How kHow>
void load(Core& core, const Op& op) {
  uint32_t value = 0;
  const uint32_t address = address_of<kHow>(core, op);
  bool done = false;
  if constexpr (kBytes == 4) done = core.load32(op, address, value);
  if constexpr (kBytes == 2) done = core.load16(op, address, value);
  if constexpr (kBytes == 1) done = core.load8(op, address, value);
  if (!done) return;
  if constexpr (kSigned) value = static_cast<uint32_t>(static_cast<int32_t>(value << (32 - 8 * kBytes)) >> (32 - 8 * kBytes));
  write_back<kHow>(core, op);
  core.state.r[op.rd] = op.rd == kSp ? value & ~3u : value;
}

template <uint32_t kBytes, How kHow>
void store(Core& core, const Op& op) {
  const uint32_t address = address_of<kHow>(core, op), value = core.state.r[op.rd];
  bool done = false;
  if constexpr (kBytes == 4) done = core.store32(op, address, value);
  if constexpr (kBytes == 2) done = core.store16(op, address, value);
  if constexpr (kBytes == 1) done = core.store8(op, address, value);
  if (done) write_back<kHow>(core, op);
}

template <How kHow>
void load_pc(Core& core, const Op& op) {
  uint32_t value = 0;
  if (!core.load32(op, address_of<kHow>(core, op), value)) return;
  write_back<kHow>(core, op);
  core.branch_interworking(op, value);
}

// LDM, STM, LDRD, LDREX and floating-point transfers have to be aligned whatever CCR says (A3.2.1).
bool aligned(Core& core, const Op& op, uint32_t address, uint32_t bytes) {
  if ((address & (bytes - 1)) == 0) return true;
  core.usage_fault(op, 1u << 24);
  return false;
}

uint32_t multiple_start(const Core& core, const Op& op, uint32_t bytes) {
  return (op.kind & 2) != 0 ? core.state.r[op.rn] - bytes : core.state.r[op.rn];
}

void multiple_write_back(Core& core, const Op& op, uint32_t bytes) {
  if ((op.kind & 1) != 0) core.state.r[op.rn] = (op.kind & 2) != 0 ? core.state.r[op.rn] - bytes : core.state.r[op.rn] + bytes;
}

uint32_t dual_address(const Core& core, const Op& op) { return op.kind == 2 ? core.state.r[op.rn] : core.state.r[op.rn] + op.imm; }

}  // namespace

#define RL_MCU_LOADS(NAME, BYTES, SIGNED)                                                      \
  void NAME##_offset(Core& core, const Op& op) { load<BYTES, SIGNED, How::offset>(core, op); } \
  void NAME##_pre(Core& core, const Op& op) { load<BYTES, SIGNED, How::pre>(core, op); }       \
  void NAME##_post(Core& core, const Op& op) { load<BYTES, SIGNED, How::post>(core, op); }     \
  void NAME##_register(Core& core, const Op& op) { load<BYTES, SIGNED, How::by_register>(core, op); }
#define RL_MCU_STORES(NAME, BYTES)                                                      \
  void NAME##_offset(Core& core, const Op& op) { store<BYTES, How::offset>(core, op); } \
  void NAME##_pre(Core& core, const Op& op) { store<BYTES, How::pre>(core, op); }       \
  void NAME##_post(Core& core, const Op& op) { store<BYTES, How::post>(core, op); }     \
  void NAME##_register(Core& core, const Op& op) { store<BYTES, How::by_register>(core, op); }
RL_MCU_LOADS(ldr, 4, false)
RL_MCU_LOADS(ldrb, 1, false)
RL_MCU_LOADS(ldrh, 2, false)
RL_MCU_LOADS(ldrsb, 1, true)
RL_MCU_LOADS(ldrsh, 2, true)
RL_MCU_STORES(str, 4)
RL_MCU_STORES(strb, 1)
RL_MCU_STORES(strh, 2)
#undef RL_MCU_LOADS
#undef RL_MCU_STORES

void load_pc_offset(Core& core, const Op& op) { load_pc<How::offset>(core, op); }
void load_pc_pre(Core& core, const Op& op) { load_pc<How::pre>(core, op); }
void load_pc_post(Core& core, const Op& op) { load_pc<How::post>(core, op); }
void load_pc_register(Core& core, const Op& op) { load_pc<How::by_register>(core, op); }

void load_literal(Core& core, const Op& op) {
  uint32_t value = 0;
  if (core.load32(op, op.imm, value)) core.state.r[op.rd] = value;
}

void transfer_unprivileged(Core& core, const Op& op) {
  const uint32_t bytes = op.kind & 7;
  const bool stores = (op.kind & 16) != 0;
  uint32_t value = core.state.r[op.rd];
  if (!core.access_unprivileged(op, core.state.r[op.rn] + op.imm, bytes, value, stores) || stores) return;
  if ((op.kind & 8) != 0) value = static_cast<uint32_t>(static_cast<int32_t>(value << (32 - 8 * bytes)) >> (32 - 8 * bytes));
  core.state.r[op.rd] = value;
}

void load_double(Core& core, const Op& op) {
  const uint32_t address = dual_address(core, op);
  uint32_t low = 0, high = 0;
  if (!aligned(core, op, address, 4) || !core.load32(op, address, low) || !core.load32(op, address + 4, high)) return;
  if (op.kind != 0) core.state.r[op.rn] += op.imm;
  core.state.r[op.rd] = low;
  core.state.r[op.rm] = high;
}

void store_double(Core& core, const Op& op) {
  const uint32_t address = dual_address(core, op);
  if (!aligned(core, op, address, 4) || !core.store32(op, address, core.state.r[op.rd]) ||
      !core.store32(op, address + 4, core.state.r[op.rm]))
    return;
  if (op.kind != 0) core.state.r[op.rn] += op.imm;
}

void load_multiple(Core& core, const Op& op) {
  const uint32_t bytes = 4 * static_cast<uint32_t>(std::popcount(op.imm));
  uint32_t address = multiple_start(core, op, bytes);
  if (!aligned(core, op, address, 4)) return;
  std::array<uint32_t, 16> loaded;
  for (uint32_t list = op.imm; list != 0; list &= list - 1, address += 4) {
    if (!core.load32(op, address, loaded[static_cast<uint32_t>(std::countr_zero(list))])) return;
  }
  multiple_write_back(core, op, bytes);
  for (uint32_t list = op.imm & 0x7FFF; list != 0; list &= list - 1) {
    const auto i = static_cast<uint32_t>(std::countr_zero(list));
    core.state.r[i] = loaded[i];
  }
  if ((op.imm & 0x8000) != 0) core.branch_interworking(op, loaded[kPc]);
}

void store_multiple(Core& core, const Op& op) {
  const uint32_t bytes = 4 * static_cast<uint32_t>(std::popcount(op.imm));
  uint32_t address = multiple_start(core, op, bytes);
  if (!aligned(core, op, address, 4)) return;
  for (uint32_t list = op.imm; list != 0; list &= list - 1, address += 4) {
    if (!core.store32(op, address, core.state.r[static_cast<uint32_t>(std::countr_zero(list))])) return;
  }
  multiple_write_back(core, op, bytes);
}

namespace {

bool exclusive_access(Core& core, const Op& op, uint32_t address, uint32_t& value, bool stores) {
  if (!aligned(core, op, address, op.kind)) return false;
  if (op.kind == 4) return stores ? core.store32(op, address, value) : core.load32(op, address, value);
  if (op.kind == 2) return stores ? core.store16(op, address, value) : core.load16(op, address, value);
  return stores ? core.store8(op, address, value) : core.load8(op, address, value);
}

}  // namespace

// The monitor of this core covers the whole memory: any exclusive store after an exclusive load succeeds, once.
void load_exclusive(Core& core, const Op& op) {
  uint32_t value = 0;
  if (!exclusive_access(core, op, core.state.r[op.rn] + op.imm, value, false)) return;
  core.state.exclusive = true;
  core.state.r[op.rd] = value;
}

void store_exclusive(Core& core, const Op& op) {
  const uint32_t address = core.state.r[op.rn] + op.imm;
  uint32_t value = core.state.r[op.rm];
  if (!core.state.exclusive) {
    if (aligned(core, op, address, op.kind)) core.state.r[op.rd] = 1;
    return;
  }
  if (!exclusive_access(core, op, address, value, true)) return;
  core.state.exclusive = false;
  core.state.r[op.rd] = 0;
}

void clear_exclusive(Core& core, const Op&) { core.state.exclusive = false; }

// Floating-point loads and stores: in this file, as their rules are those of memory.
void vldr(Core& core, const Op& op) {
  const uint32_t address = core.state.r[op.rn] + op.imm;
  uint32_t low = 0, high = 0;
  if (!core.prepare_fp(op) || !aligned(core, op, address, 4) || !core.load32(op, address, low)) return;
  if (op.kind != 0) {
    if (!core.load32(op, address + 4, high)) return;
    core.state.s[op.rd + 1u] = high;
  }
  core.state.s[op.rd] = low;
}

void vstr(Core& core, const Op& op) {
  const uint32_t address = core.state.r[op.rn] + op.imm;
  if (!core.prepare_fp(op) || !aligned(core, op, address, 4) || !core.store32(op, address, core.state.s[op.rd])) return;
  if (op.kind != 0) core.store32(op, address + 4, core.state.s[op.rd + 1u]);
}

void vload_multiple(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  const uint32_t address = multiple_start(core, op, op.imm * 4);
  if (!aligned(core, op, address, 4)) return;
  for (uint32_t i = 0; i < op.extra; ++i) {
    uint32_t value = 0;
    if (!core.load32(op, address + 4 * i, value)) return;
    core.state.s[op.rd + i] = value;
  }
  multiple_write_back(core, op, op.imm * 4);
}

void vstore_multiple(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  const uint32_t address = multiple_start(core, op, op.imm * 4);
  if (!aligned(core, op, address, 4)) return;
  for (uint32_t i = 0; i < op.extra; ++i) {
    if (!core.store32(op, address + 4 * i, core.state.s[op.rd + i])) return;
  }
  multiple_write_back(core, op, op.imm * 4);
}

}  // namespace rotorloop::mcu::exec
