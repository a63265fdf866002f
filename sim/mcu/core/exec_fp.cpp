// Floating-point arithmetic and conversions. Nearly always the host's own operation gives result and flags; soft_float.hpp has the rest.
#include <bit>
#include <cmath>

#include "sim/mcu/core/core.hpp"
#include "sim/mcu/core/handlers.hpp"
#include "sim/mcu/core/soft_float.hpp"

namespace rotorloop::mcu::exec {
namespace {

float as_float(uint32_t bits) { return std::bit_cast<float>(bits); }
uint32_t as_bits(float value) { return std::bit_cast<uint32_t>(value); }

// The host's operation rounds to nearest, as FPSCR nearly always says. A result that is a normal number above the smallest one can then
// raise the inexact flag only; once that is set nothing is left to find out. Flush to zero: operands must be normal or zero, too.
bool short_way(uint32_t fpscr) { return (fpscr & (0xC00000u | fp::kInexact | fp::kFlushToZero)) == fp::kInexact; }
bool is_plain(uint32_t result) { return (((result >> 23) + 1) & 0xFF) > 2; }  // exponent 2 to 254

uint32_t sum(uint32_t a, uint32_t b, uint32_t& fpscr) {
  const uint32_t result = as_bits(as_float(a) + as_float(b));
  return short_way(fpscr) && is_plain(result) ? result : fp::add(a, b, fpscr);
}

uint32_t difference(uint32_t a, uint32_t b, uint32_t& fpscr) {
  const uint32_t result = as_bits(as_float(a) - as_float(b));
  return short_way(fpscr) && is_plain(result) ? result : fp::subtract(a, b, fpscr);
}

uint32_t product(uint32_t a, uint32_t b, uint32_t& fpscr) {
  const uint32_t result = as_bits(as_float(a) * as_float(b));
  return short_way(fpscr) && is_plain(result) ? result : fp::multiply(a, b, fpscr);
}

uint32_t& s(Core& core, uint32_t index) { return core.state.s[index]; }

}  // namespace

#define RL_MCU_FP(NAME, VALUE)                                                 \
  void NAME(Core& core, const Op& op) {                                        \
    if (!core.prepare_fp(op)) return;                                          \
    uint32_t& fpscr = core.state.fpscr;                                        \
    const uint32_t d = s(core, op.rd), n = s(core, op.rn), m = s(core, op.rm); \
    static_cast<void>(d);                                                      \
    s(core, op.rd) = VALUE;                                                    \
  }
RL_MCU_FP(vadd, sum(n, m, fpscr))
RL_MCU_FP(vsub, difference(n, m, fpscr))
RL_MCU_FP(vmul, product(n, m, fpscr))
RL_MCU_FP(vnmul, fp::negated(product(n, m, fpscr)))
RL_MCU_FP(vmla, sum(d, product(n, m, fpscr), fpscr))
RL_MCU_FP(vmls, sum(d, fp::negated(product(n, m, fpscr)), fpscr))
RL_MCU_FP(vnmla, sum(fp::negated(d), fp::negated(product(n, m, fpscr)), fpscr))
RL_MCU_FP(vnmls, sum(fp::negated(d), product(n, m, fpscr), fpscr))
RL_MCU_FP(vfma, fp::multiply_add(d, n, m, fpscr))
RL_MCU_FP(vfms, fp::multiply_add(d, fp::negated(n), m, fpscr))
RL_MCU_FP(vfnma, fp::multiply_add(fp::negated(d), fp::negated(n), m, fpscr))
RL_MCU_FP(vfnms, fp::multiply_add(fp::negated(d), n, m, fpscr))
#undef RL_MCU_FP

void vdiv(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  const uint32_t n = s(core, op.rn), m = s(core, op.rm), result = as_bits(as_float(n) / as_float(m));
  s(core, op.rd) = short_way(core.state.fpscr) && is_plain(result) ? result : fp::divide(n, m, core.state.fpscr);
}

void vsqrt(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  const uint32_t m = s(core, op.rm), result = as_bits(std::sqrt(as_float(m)));
  s(core, op.rd) = short_way(core.state.fpscr) && is_plain(result) ? result : fp::square_root(m, core.state.fpscr);
}

void vabs(Core& core, const Op& op) {
  if (core.prepare_fp(op)) s(core, op.rd) = s(core, op.rm) & 0x7FFFFFFF;
}
void vneg(Core& core, const Op& op) {
  if (core.prepare_fp(op)) s(core, op.rd) = fp::negated(s(core, op.rm));
}
void vmov(Core& core, const Op& op) {
  if (core.prepare_fp(op)) s(core, op.rd) = s(core, op.rm);
}
void vmov_imm(Core& core, const Op& op) {
  if (core.prepare_fp(op)) s(core, op.rd) = op.imm;
}

namespace {
void compare(Core& core, const Op& op, uint32_t with) {
  uint32_t fpscr = core.state.fpscr & 0x0FFFFFFF;
  const uint32_t flags = fp::compare(s(core, op.rd), with, op.kind != 0, fpscr);
  core.state.fpscr = fpscr | flags;
}
}  // namespace

void vcmp(Core& core, const Op& op) {
  if (core.prepare_fp(op)) compare(core, op, s(core, op.rm));
}
void vcmp_zero(Core& core, const Op& op) {
  if (core.prepare_fp(op)) compare(core, op, 0);
}

void vcvt_from_int(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  uint32_t& fpscr = core.state.fpscr;
  s(core, op.rd) = fp::from_fixed(s(core, op.rm), 32, 0, op.kind != 0, fp::rounding(fpscr), fpscr);
}

void vcvt_to_int(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  uint32_t& fpscr = core.state.fpscr;
  const fp::Rounding mode = (op.kind & 2) != 0 ? fp::rounding(fpscr) : fp::Rounding::zero;
  s(core, op.rd) = fp::to_fixed(s(core, op.rm), 32, 0, (op.kind & 1) != 0, mode, fpscr);
}

// From and to the same register. A result of 16 bits is extended by its sign or by zeros.
void vcvt_fixed(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  const bool is_signed = (op.kind & 1) == 0;
  const uint32_t bits = (op.kind & 2) != 0 ? 32 : 16, value = s(core, op.rd);
  uint32_t& fpscr = core.state.fpscr;
  if ((op.kind & 4) != 0)
    s(core, op.rd) = fp::to_fixed(value, bits, op.imm, is_signed, fp::Rounding::zero, fpscr);
  else
    s(core, op.rd) = fp::from_fixed(value, bits, op.imm, is_signed, fp::Rounding::nearest, fpscr);
}

void vcvt_half(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  const bool top = (op.kind & 1) != 0;
  const uint32_t m = s(core, op.rm);
  if ((op.kind & 2) == 0) {
    s(core, op.rd) = fp::from_half(top ? m >> 16 : m & 0xFFFF, core.state.fpscr);
    return;
  }
  const uint32_t half = fp::to_half(m, core.state.fpscr), d = s(core, op.rd);
  s(core, op.rd) = top ? half << 16 | (d & 0xFFFF) : (d & 0xFFFF0000) | half;
}

void vmov_to_s(Core& core, const Op& op) {
  if (core.prepare_fp(op)) s(core, op.rn) = core.state.r[op.rd];
}
void vmov_from_s(Core& core, const Op& op) {
  if (core.prepare_fp(op)) core.state.r[op.rd] = s(core, op.rn);
}

void vmov_two_to_s(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  s(core, op.rm) = core.state.r[op.rd];
  s(core, op.rm + 1u) = core.state.r[op.ra];
}
void vmov_two_from_s(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  core.state.r[op.rd] = s(core, op.rm);
  core.state.r[op.ra] = s(core, op.rm + 1u);
}

void vmrs(Core& core, const Op& op) {
  if (!core.prepare_fp(op)) return;
  if (op.rd != kPc) {
    core.state.r[op.rd] = core.state.fpscr;
    return;
  }
  core.set_apsr((core.apsr() & 0x0FFFFFFF) | (core.state.fpscr & 0xF0000000), true, false);
}
void vmsr(Core& core, const Op& op) {
  if (core.prepare_fp(op)) core.state.fpscr = core.state.r[op.rd] & 0xF7C0009F;
}

// Coprocessors 10 and 11 without such an instruction (extra: 1), or another coprocessor.
void no_coprocessor(Core& core, const Op& op) {
  if (op.extra == 0)
    core.usage_fault(op, 1u << 19);
  else if (core.prepare_fp(op))
    core.usage_fault(op, 1u << 16);
}

}  // namespace rotorloop::mcu::exec
