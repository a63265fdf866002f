// Single-precision arithmetic exactly as the FPU has it: NaN rules, flush to zero, default NaN, four rounding modes, cumulative flags
// (A2.5 of DDI 0403). Written with integers: no result and no flag depends on the host's floating-point unit.
#pragma once
#include <cstdint>

#include "sim/mcu/core/fpscr.hpp"

namespace rotorloop::mcu::fp {

// Operands and results are bit patterns; flags are added to fpscr.
uint32_t add(uint32_t a, uint32_t b, uint32_t& fpscr);
uint32_t subtract(uint32_t a, uint32_t b, uint32_t& fpscr);
uint32_t multiply(uint32_t a, uint32_t b, uint32_t& fpscr);
uint32_t divide(uint32_t a, uint32_t b, uint32_t& fpscr);
uint32_t square_root(uint32_t a, uint32_t& fpscr);
uint32_t multiply_add(uint32_t addend, uint32_t a, uint32_t b, uint32_t& fpscr);  // one rounding
// NZCV in bits 31 to 28. signal_all: any NaN is invalid, not only a signalling one.
uint32_t compare(uint32_t a, uint32_t b, bool signal_all, uint32_t& fpscr);

// A number with `fraction` bits behind the point, in the low `bits` of the word.
uint32_t from_fixed(uint32_t value, uint32_t bits, uint32_t fraction, bool is_signed, Rounding mode, uint32_t& fpscr);
// What does not fit saturates and is invalid; a NaN becomes 0.
uint32_t to_fixed(uint32_t a, uint32_t bits, uint32_t fraction, bool is_signed, Rounding mode, uint32_t& fpscr);
uint32_t from_half(uint32_t half, uint32_t& fpscr);
uint32_t to_half(uint32_t a, uint32_t& fpscr);

inline constexpr uint32_t negated(uint32_t a) { return a ^ 0x80000000u; }

}  // namespace rotorloop::mcu::fp
