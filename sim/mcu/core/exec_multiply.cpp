// Multiplication and division. Sums that wrap do so in 32 or 64 bits, as the registers are.
#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/costs.hpp"
#include "sim/mcu/core/handlers.hpp"

namespace rotorloop::mcu::exec {
namespace {

int64_t signed_word(uint32_t value) { return static_cast<int32_t>(value); }
int32_t halfword(uint32_t value, bool top) { return static_cast<int16_t>(top ? value >> 16 : value); }

uint64_t long_accumulator(const Core& core, const Op& op) { return uint64_t{core.state.r[op.rd]} << 32 | core.state.r[op.ra]; }

void set_long(Core& core, const Op& op, uint64_t value) {
  core.state.r[op.ra] = static_cast<uint32_t>(value);
  core.state.r[op.rd] = static_cast<uint32_t>(value >> 32);
}

// The sum in 32 bits; Q when it does not fit.
void set_sum(Core& core, const Op& op, int64_t sum) {
  if (sum != static_cast<int32_t>(sum)) core.state.q = 1;
  core.state.r[op.rd] = static_cast<uint32_t>(sum);
}

// Two products of halfwords; extra: their difference; bit 0 of kind: halfwords of the second operand exchanged.
int64_t two_products(const Core& core, const Op& op) {
  const uint32_t n = core.state.r[op.rn];
  uint32_t m = core.state.r[op.rm];
  if ((op.kind & 1) != 0) m = m << 16 | m >> 16;
  const int64_t low = int64_t{halfword(n, false)} * halfword(m, false), high = int64_t{halfword(n, true)} * halfword(m, true);
  return op.extra != 0 ? low - high : low + high;
}

}  // namespace

void multiply(Core& core, const Op& op) { core.state.r[op.rd] = core.state.r[op.rn] * core.state.r[op.rm]; }

void multiply_flags(Core& core, const Op& op) {
  multiply(core, op);
  core.set_nz(core.state.r[op.rd]);
}

void multiply_accumulate(Core& core, const Op& op) {
  core.state.r[op.rd] = core.state.r[op.rn] * core.state.r[op.rm] + core.state.r[op.ra];
}

void multiply_subtract(Core& core, const Op& op) { core.state.r[op.rd] = core.state.r[op.ra] - core.state.r[op.rn] * core.state.r[op.rm]; }

void unsigned_long(Core& core, const Op& op) { set_long(core, op, uint64_t{core.state.r[op.rn]} * core.state.r[op.rm]); }

void signed_long(Core& core, const Op& op) {
  set_long(core, op, static_cast<uint64_t>(signed_word(core.state.r[op.rn]) * signed_word(core.state.r[op.rm])));
}

void unsigned_long_accumulate(Core& core, const Op& op) {
  set_long(core, op, long_accumulator(core, op) + uint64_t{core.state.r[op.rn]} * core.state.r[op.rm]);
}

void signed_long_accumulate(Core& core, const Op& op) {
  set_long(core, op,
           long_accumulator(core, op) + static_cast<uint64_t>(signed_word(core.state.r[op.rn]) * signed_word(core.state.r[op.rm])));
}

void unsigned_long_double_accumulate(Core& core, const Op& op) {
  set_long(core, op, uint64_t{core.state.r[op.rn]} * core.state.r[op.rm] + core.state.r[op.ra] + core.state.r[op.rd]);
}

namespace {

// Division by zero gives 0, or a fault when CCR.DIV_0_TRP is set.
bool divides(Core& core, const Op& op, uint32_t divisor) {
  if (divisor != 0) return true;
  if ((core.state.scb.ccr & 0x10) != 0)
    core.usage_fault(op, 1u << 25);
  else
    core.state.r[op.rd] = 0;
  return false;
}

}  // namespace

void signed_divide(Core& core, const Op& op) {
  const uint32_t n = core.state.r[op.rn], m = core.state.r[op.rm];
  if (!divides(core, op, m)) return;
  const int64_t a = signed_word(n), b = signed_word(m);
  core.state.cycle += cost::divide(static_cast<uint32_t>(a < 0 ? -a : a), static_cast<uint32_t>(b < 0 ? -b : b)) - 1;
  core.state.r[op.rd] = static_cast<uint32_t>(a / b);
}

void unsigned_divide(Core& core, const Op& op) {
  const uint32_t n = core.state.r[op.rn], m = core.state.r[op.rm];
  if (!divides(core, op, m)) return;
  core.state.cycle += cost::divide(n, m) - 1;
  core.state.r[op.rd] = n / m;
}

// SMULxy, SMLAxy: bit 1 of kind chooses the half of the first operand, bit 0 that of the second.
void multiply_halfwords(Core& core, const Op& op) {
  const int64_t product = int64_t{halfword(core.state.r[op.rn], (op.kind & 2) != 0)} * halfword(core.state.r[op.rm], (op.kind & 1) != 0);
  set_sum(core, op, product + signed_word(core.state.r[op.ra]));
}

void multiply_word_halfword(Core& core, const Op& op) {
  const int64_t product = signed_word(core.state.r[op.rn]) * halfword(core.state.r[op.rm], (op.kind & 1) != 0);
  set_sum(core, op, (product >> 16) + signed_word(core.state.r[op.ra]));
}

void dual_multiply(Core& core, const Op& op) { set_sum(core, op, two_products(core, op) + signed_word(core.state.r[op.ra])); }

void dual_multiply_long(Core& core, const Op& op) {
  set_long(core, op, long_accumulator(core, op) + static_cast<uint64_t>(two_products(core, op)));
}

void long_halfwords(Core& core, const Op& op) {
  const int64_t product = int64_t{halfword(core.state.r[op.rn], (op.kind & 2) != 0)} * halfword(core.state.r[op.rm], (op.kind & 1) != 0);
  set_long(core, op, long_accumulator(core, op) + static_cast<uint64_t>(product));
}

// SMMLA, SMMUL; extra: SMMLS; bit 0 of kind rounds.
void most_significant(Core& core, const Op& op) {
  const uint64_t product = static_cast<uint64_t>(signed_word(core.state.r[op.rn]) * signed_word(core.state.r[op.rm]));
  const uint64_t base = uint64_t{core.state.r[op.ra]} << 32;
  const uint64_t sum = (op.extra != 0 ? base - product : base + product) + ((op.kind & 1) != 0 ? 0x80000000u : 0u);
  core.state.r[op.rd] = static_cast<uint32_t>(sum >> 32);
}

}  // namespace rotorloop::mcu::exec
