// Branches, IT, special registers, hints, supervisor calls.
#include <utility>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/decode.hpp"
#include "sim/mcu/core/handlers.hpp"

namespace rotorloop::mcu {

void Core::branch_interworking(const Op& op, uint32_t address) {
  if (address >> 28 == 15 && state.ipsr != 0) {
    begin_return(op, address);
    return;
  }
  state.r[kPc] = address & ~1u;
  if ((address & 1) == 0) {
    state.thumb = 0;
    look_again();
  }
}

Execute exec_always() { return exec::breakpoint; }

namespace exec {

void branch_to(Core& core, const Op& op) { core.state.r[kPc] = op.imm; }

void branch_if(Core& core, const Op& op) {
  if (!core.condition(op.kind)) return;
  core.state.r[kPc] = op.imm;
  core.state.cycle += cost::kRefill;
}

void branch_link(Core& core, const Op& op) {
  core.state.r[kLr] = core.state.r[kPc] | 1;
  core.state.r[kPc] = op.imm;
}

void branch_exchange(Core& core, const Op& op) { core.branch_interworking(op, core.state.r[op.rm]); }

// An EXC_RETURN value is none here: BLX does not return from exceptions.
void branch_link_exchange(Core& core, const Op& op) {
  const uint32_t target = core.state.r[op.rm];
  core.state.r[kLr] = core.state.r[kPc] | 1;
  core.state.r[kPc] = target & ~1u;
  if ((target & 1) == 0) {
    core.state.thumb = 0;
    core.look_again();
  }
}

void branch_if_zero(Core& core, const Op& op) {
  if (core.state.r[op.rn] != 0) return;
  core.state.r[kPc] = op.imm;
  core.state.cycle += cost::kRefill;
}

void branch_if_nonzero(Core& core, const Op& op) {
  if (core.state.r[op.rn] == 0) return;
  core.state.r[kPc] = op.imm;
  core.state.cycle += cost::kRefill;
}

void table_branch(Core& core, const Op& op) {
  const uint32_t base = op.rn == kPc ? op.imm : core.state.r[op.rn], index = core.state.r[op.rm];
  uint32_t halfwords = 0;
  if (op.kind != 0 ? !core.load16(op, base + 2 * index, halfwords) : !core.load8(op, base + index, halfwords)) return;
  core.state.r[kPc] = op.imm + 2 * halfwords;
}

void if_then(Core& core, const Op& op) { core.set_it(op.imm); }

void supervisor_call(Core& core, const Op& op) {
  core.take_synchronous(kSvCall, core.state.r[kPc], (op.tag & kTagInIt) != 0 ? core.state.it : 0);
}

void breakpoint(Core& core, const Op& op) { core.breakpoint(op); }

// CPSIE, CPSID; imm bit 4: disable, bit 1: PRIMASK, bit 0: FAULTMASK.
void change_state(Core& core, const Op& op) {
  if (!core.privileged()) return;
  const uint32_t masked = op.imm >> 4;
  if ((op.imm & 2) != 0) core.state.primask = masked;
  if ((op.imm & 1) != 0 && (masked == 0 || core.execution_priority() > -1)) core.state.faultmask = masked;
  core.look_again();
}

namespace {

void write_sp(Core& core, bool process, uint32_t value) {
  (process == core.uses_psp() ? core.state.r[kSp] : core.state.other_sp) = value & ~3u;
}

void write_control(Core& core, uint32_t value) {
  CoreState& s = core.state;
  const bool was_psp = core.uses_psp();
  const bool fpu = (s.scb.cpacr >> 20 & 3) != 0;
  uint32_t next = (s.control & 2) | (value & 1) | (fpu ? value & 4 : s.control & 4);
  if (s.ipsr == 0) next = (next & ~2u) | (value & 2);
  s.control = next;
  if (core.uses_psp() != was_psp) std::swap(s.r[kSp], s.other_sp);
  core.privilege_changed();
}

void write_mask(Core& core, uint32_t which, uint32_t value) {
  CoreState& s = core.state;
  const uint32_t priority = value & kPriorityMask;
  switch (which) {
    case 16:
      s.primask = value & 1;
      break;
    case 17:
      s.basepri = priority;
      break;
    case 18:
      if (priority != 0 && (s.basepri == 0 || priority < s.basepri)) s.basepri = priority;
      break;
    default:
      if ((value & 1) == 0 || core.execution_priority() > -1) s.faultmask = value & 1;
      break;
  }
  core.look_again();
}

}  // namespace

// MRS: imm is the number of the register (B5.2.2). EPSR reads as zero.
void read_special(Core& core, const Op& op) {
  const CoreState& s = core.state;
  uint32_t value = 0;
  if (op.imm < 8) {
    if ((op.imm & 1) != 0) value |= s.ipsr;
    if ((op.imm & 4) == 0) value |= core.apsr();
  } else if (op.imm == 20) {
    value = s.control;
  } else if (core.privileged()) {
    switch (op.imm) {
      case 8:
        value = core.main_sp();
        break;
      case 9:
        value = core.process_sp();
        break;
      case 16:
        value = s.primask;
        break;
      case 17:
      case 18:
        value = s.basepri;
        break;
      case 19:
        value = s.faultmask;
        break;
      default:
        break;
    }
  }
  core.state.r[op.rd] = value;
}

void write_special(Core& core, const Op& op) {
  const uint32_t value = core.state.r[op.rn];
  if (op.imm < 4) {
    core.set_apsr(value, (op.kind & 2) != 0, (op.kind & 1) != 0);
    return;
  }
  if (!core.privileged()) return;
  if (op.imm == 8 || op.imm == 9) write_sp(core, op.imm == 9, value);
  if (op.imm >= 16 && op.imm <= 19) write_mask(core, op.imm, value);
  if (op.imm == 20) write_control(core, value);
}

void wait_for_interrupt(Core& core, const Op&) {
  core.state.sleeping = true;
  core.state.sleeping_for_event = false;
  core.look_again();
}

void wait_for_event(Core& core, const Op&) {
  if (core.state.event) {
    core.state.event = false;
    return;
  }
  core.state.sleeping = core.state.sleeping_for_event = true;
  core.look_again();
}

void send_event(Core& core, const Op&) { core.state.event = true; }

void barrier(Core&, const Op&) {}  // every access is done when its instruction is

}  // namespace exec
}  // namespace rotorloop::mcu
