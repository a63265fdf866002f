// Data processing: arithmetic, logic, shifts, bit fields, extension, saturation.
#include <bit>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/handlers.hpp"

namespace rotorloop::mcu {
namespace {

// Shift_C of the manual (A2.2.1): carry goes in and out; an amount of 0 changes neither. Amounts of registers go up to 255.
uint32_t shifted(uint32_t value, uint32_t kind, uint32_t amount, uint32_t& carry) {
  if (kind == kRrx) {
    const uint32_t out = value & 1;
    value = value >> 1 | carry << 31;
    carry = out;
    return value;
  }
  if (amount == 0) return value;
  switch (kind) {
    case kLsl:
      carry = amount > 32 ? 0 : value >> (32 - amount) & 1;
      return amount > 31 ? 0 : value << amount;
    case kLsr:
      carry = amount > 32 ? 0 : value >> (amount - 1) & 1;
      return amount > 31 ? 0 : value >> amount;
    case kAsr: {
      const uint32_t by = amount > 31 ? 31 : amount;
      carry = amount > 31 ? value >> 31 : value >> (amount - 1) & 1;
      return static_cast<uint32_t>(static_cast<int32_t>(value) >> by);
    }
    default:
      value = std::rotr(value, static_cast<int>(amount & 31));
      carry = value >> 31;
      return value;
  }
}

// AddWithCarry (A2.2.1).
uint32_t add_with_carry(CoreState& s, uint32_t a, uint32_t b, uint32_t carry, bool flags) {
  const uint64_t sum = uint64_t{a} + b + carry;
  const auto result = static_cast<uint32_t>(sum);
  if (flags) {
    s.n = s.z = result;
    s.c = static_cast<uint32_t>(sum >> 32);
    s.v = (~(a ^ b) & (a ^ result)) >> 31;
  }
  return result;
}

template <Alu kOperation>
constexpr bool kLogical = kOperation <= Alu::bit_xor;

template <Alu kOperation, bool kFlags, Form kForm, bool kToSp>
void execute_alu(Core& core, const Op& op) {
  CoreState& s = core.state;
  const uint32_t a = s.r[op.rn];
  uint32_t carry = s.c, b = op.imm;
  if constexpr (kForm == Form::plain) b = s.r[op.rm];
  if constexpr (kForm == Form::shifted) b = shifted(s.r[op.rm], op.kind, op.imm, carry);
  if constexpr (kForm == Form::immediate && kFlags && kLogical<kOperation>) {
    if (op.extra != 2) carry = op.extra;
  }
  uint32_t result = 0;
  switch (kOperation) {
    case Alu::bit_and:
      result = a & b;
      break;
    case Alu::bit_clear:
      result = a & ~b;
      break;
    case Alu::bit_or:
      result = a | b;
      break;
    case Alu::bit_or_not:
      result = a | ~b;
      break;
    case Alu::bit_xor:
      result = a ^ b;
      break;
    case Alu::add:
      result = add_with_carry(s, a, b, 0, kFlags);
      break;
    case Alu::add_carry:
      result = add_with_carry(s, a, b, s.c, kFlags);
      break;
    case Alu::sub_carry:
      result = add_with_carry(s, a, ~b, s.c, kFlags);
      break;
    case Alu::sub:
      result = add_with_carry(s, a, ~b, 1, kFlags);
      break;
    case Alu::reverse_sub:
      result = add_with_carry(s, ~a, b, 1, kFlags);
      break;
  }
  if constexpr (kFlags && kLogical<kOperation>) {
    s.n = s.z = result;
    s.c = carry;
  }
  s.r[op.rd] = kToSp ? result & ~3u : result;
}

template <Alu kOperation, bool kToSp>
Execute alu_form(bool flags, Form form) {
  switch (form) {
    case Form::immediate:
      return flags ? execute_alu<kOperation, true, Form::immediate, kToSp> : execute_alu<kOperation, false, Form::immediate, kToSp>;
    case Form::plain:
      return flags ? execute_alu<kOperation, true, Form::plain, kToSp> : execute_alu<kOperation, false, Form::plain, kToSp>;
    default:
      return flags ? execute_alu<kOperation, true, Form::shifted, kToSp> : execute_alu<kOperation, false, Form::shifted, kToSp>;
  }
}

template <Alu kOperation>
Execute alu_to(bool flags, Form form, uint32_t rd) {
  return rd == kSp ? alu_form<kOperation, true>(flags, form) : alu_form<kOperation, false>(flags, form);
}

uint32_t mask(uint32_t width) { return width >= 32 ? ~0u : (1u << width) - 1; }

}  // namespace

Execute alu(Alu operation, bool flags, Form form, uint32_t rd) {
  switch (operation) {
    case Alu::bit_and:
      return alu_to<Alu::bit_and>(flags, form, rd);
    case Alu::bit_clear:
      return alu_to<Alu::bit_clear>(flags, form, rd);
    case Alu::bit_or:
      return alu_to<Alu::bit_or>(flags, form, rd);
    case Alu::bit_or_not:
      return alu_to<Alu::bit_or_not>(flags, form, rd);
    case Alu::bit_xor:
      return alu_to<Alu::bit_xor>(flags, form, rd);
    case Alu::add:
      return alu_to<Alu::add>(flags, form, rd);
    case Alu::add_carry:
      return alu_to<Alu::add_carry>(flags, form, rd);
    case Alu::sub_carry:
      return alu_to<Alu::sub_carry>(flags, form, rd);
    case Alu::sub:
      return alu_to<Alu::sub>(flags, form, rd);
    default:
      return alu_to<Alu::reverse_sub>(flags, form, rd);
  }
}

namespace exec {

void undefined(Core& core, const Op& op) { core.usage_fault(op, 1u << 16); }

void nop(Core&, const Op&) {}

void move_top(Core& core, const Op& op) { core.state.r[op.rd] = (core.state.r[op.rd] & 0xFFFF) | op.imm << 16; }

void shift_by_register(Core& core, const Op& op) {
  uint32_t carry = core.state.c;
  core.state.r[op.rd] = shifted(core.state.r[op.rn], op.kind, core.state.r[op.rm] & 0xFF, carry);
}

void shift_by_register_flags(Core& core, const Op& op) {
  const uint32_t result = shifted(core.state.r[op.rn], op.kind, core.state.r[op.rm] & 0xFF, core.state.c);
  core.state.r[op.rd] = result;
  core.set_nz(result);
}

void add_to_pc(Core& core, const Op& op) { core.branch(op.imm + (op.rm == kPc ? op.imm : core.state.r[op.rm])); }

void move_to_pc(Core& core, const Op& op) { core.branch(op.rm == kPc ? op.imm : core.state.r[op.rm]); }

void clz(Core& core, const Op& op) { core.state.r[op.rd] = static_cast<uint32_t>(std::countl_zero(core.state.r[op.rm])); }

void rbit(Core& core, const Op& op) {
  uint32_t v = core.state.r[op.rm], reversed = 0;
  for (int i = 0; i < 32; ++i, v >>= 1) reversed = reversed << 1 | (v & 1);
  core.state.r[op.rd] = reversed;
}

void rev(Core& core, const Op& op) {
  const uint32_t v = core.state.r[op.rm];
  core.state.r[op.rd] = v << 24 | (v << 8 & 0xFF0000) | (v >> 8 & 0xFF00) | v >> 24;
}

void rev16(Core& core, const Op& op) {
  const uint32_t v = core.state.r[op.rm];
  core.state.r[op.rd] = (v << 8 & 0xFF00FF00) | (v >> 8 & 0x00FF00FF);
}

void revsh(Core& core, const Op& op) {
  const uint32_t v = core.state.r[op.rm];
  core.state.r[op.rd] = static_cast<uint32_t>(static_cast<int16_t>((v << 8 & 0xFF00) | (v >> 8 & 0xFF)));
}

void bit_field_insert(Core& core, const Op& op) {
  const uint32_t field = mask(op.extra) << op.kind;
  core.state.r[op.rd] = (core.state.r[op.rd] & ~field) | (core.state.r[op.rn] << op.kind & field);
}

void bit_field_extract(Core& core, const Op& op) { core.state.r[op.rd] = core.state.r[op.rn] >> op.kind & mask(op.extra); }

void signed_bit_field_extract(Core& core, const Op& op) {
  const uint32_t left = 32u - op.extra - op.kind;
  core.state.r[op.rd] = static_cast<uint32_t>(static_cast<int32_t>(core.state.r[op.rn] << left) >> (32 - op.extra));
}

void extend(Core& core, const Op& op) {
  const uint32_t v = std::rotr(core.state.r[op.rm], static_cast<int>(op.imm)), n = core.state.r[op.rn];
  const auto halves = [](uint32_t low, uint32_t high, uint32_t base) { return ((base + low) & 0xFFFF) | ((base >> 16) + high) << 16; };
  uint32_t result = 0;
  switch (op.kind) {
    case 0:
      result = n + static_cast<uint32_t>(static_cast<int8_t>(v));
      break;
    case 1:
      result = n + static_cast<uint32_t>(static_cast<int16_t>(v));
      break;
    case 2:
      result = n + (v & 0xFF);
      break;
    case 3:
      result = n + (v & 0xFFFF);
      break;
    case 4:
      result = halves(static_cast<uint32_t>(static_cast<int8_t>(v)), static_cast<uint32_t>(static_cast<int8_t>(v >> 16)), n);
      break;
    default:
      result = halves(v & 0xFF, v >> 16 & 0xFF, n);
      break;
  }
  core.state.r[op.rd] = result;
}

// PKHBT shifts left, PKHTB (kind ASR) right.
void pack(Core& core, const Op& op) {
  uint32_t carry = 0;
  const uint32_t n = core.state.r[op.rn], m = shifted(core.state.r[op.rm], op.kind, op.imm, carry);
  core.state.r[op.rd] = op.kind == kAsr ? (n & 0xFFFF0000) | (m & 0xFFFF) : (m & 0xFFFF0000) | (n & 0xFFFF);
}

void select_bytes(Core& core, const Op& op) {
  uint32_t from_n = 0;
  for (uint32_t i = 0; i < 4; ++i) from_n |= (core.state.ge >> i & 1) != 0 ? 0xFFu << (8 * i) : 0;
  core.state.r[op.rd] = (core.state.r[op.rn] & from_n) | (core.state.r[op.rm] & ~from_n);
}

namespace {

uint32_t saturate_between(CoreState& s, int32_t value, int32_t low, int32_t high) {
  if (value >= low && value <= high) return static_cast<uint32_t>(value);
  s.q = 1;
  return static_cast<uint32_t>(value < low ? low : high);
}

int32_t largest(uint32_t bits) { return static_cast<int32_t>((uint64_t{1} << bits) - 1); }

int32_t saturation_operand(const Core& core, const Op& op) {
  uint32_t carry = 0;
  return static_cast<int32_t>(shifted(core.state.r[op.rm], op.kind, op.imm, carry));
}

}  // namespace

void signed_saturate(Core& core, const Op& op) {
  const int32_t high = largest(op.extra - 1u);
  core.state.r[op.rd] = saturate_between(core.state, saturation_operand(core, op), -high - 1, high);
}

void unsigned_saturate(Core& core, const Op& op) {
  core.state.r[op.rd] = saturate_between(core.state, saturation_operand(core, op), 0, largest(op.extra));
}

void signed_saturate16(Core& core, const Op& op) {
  const uint32_t v = core.state.r[op.rm];
  const int32_t high = largest(op.extra - 1u);
  const uint32_t top = saturate_between(core.state, static_cast<int16_t>(v >> 16), -high - 1, high);
  core.state.r[op.rd] = top << 16 | (saturate_between(core.state, static_cast<int16_t>(v), -high - 1, high) & 0xFFFF);
}

void unsigned_saturate16(Core& core, const Op& op) {
  const uint32_t v = core.state.r[op.rm];
  const uint32_t top = saturate_between(core.state, static_cast<int16_t>(v >> 16), 0, largest(op.extra));
  core.state.r[op.rd] = top << 16 | saturate_between(core.state, static_cast<int16_t>(v), 0, largest(op.extra));
}

}  // namespace exec
}  // namespace rotorloop::mcu
