// Operational amplifiers (RM0440, section 25): each shunt's, with the internal gain and its output on a pin that an ADC reads.
#pragma once
#include "firmware/board/g431/register.hpp"

namespace rotorloop::g431 {

struct OpampRegisters {
  Register csr[3];
  Reserved<3> reserved_0c;
  Register tcmr[3];
};
static_assert(offsetof(OpampRegisters, tcmr) == 0x18);
inline OpampRegisters& opamp() { return block<OpampRegisters, 0x40010300>(); }

namespace opamp_bits {
inline constexpr std::uint32_t kOn = bit(0), kInput0 = field(0, 2), kPga = field(2, 5), kHighSpeed = bit(7), kCalibrates = bit(11),
                               kLock = bit(31);
inline constexpr std::uint32_t kGain16Bias = field(0x0B, 14);  // times 16, with the pin VINM0 as bias
}  // namespace opamp_bits

inline constexpr std::uint32_t kShuntAmplifier =
    opamp_bits::kOn | opamp_bits::kInput0 | opamp_bits::kPga | opamp_bits::kHighSpeed | opamp_bits::kGain16Bias;

// All three, and fixed until the next reset.
inline void start_shunt_amplifiers() {
  for (Register& csr : opamp().csr) {
    csr.write(kShuntAmplifier);
    csr.write(kShuntAmplifier | opamp_bits::kLock);
  }
}

}  // namespace rotorloop::g431
