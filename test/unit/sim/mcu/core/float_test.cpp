// The floating-point unit's own rules (DDI 0403, A2.5) and its arithmetic against the host's, which shares no line with it.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "sim/mcu/core/soft_float.hpp"
#include "test/unit/sim/mcu/core/machine.hpp"

namespace rotorloop::mcu::testing {
namespace {

constexpr uint32_t kUp = 1u << 22, kDown = 2u << 22, kTowardZero = 3u << 22;
constexpr uint32_t kOne = 0x3F800000, kTwo = 0x40000000, kThree = 0x40400000, kInfinity = 0x7F800000, kMinus = 0x80000000;
constexpr uint32_t kSmallest = 0x00000001, kSmallestNormal = 0x00800000, kLargest = 0x7F7FFFFF, kSignalling = 0x7F800001,
                   kQuiet = 0x7FC00123;

struct Flags {
  uint32_t result, flags;
  bool operator==(const Flags&) const = default;
};
template <class Operation>
Flags with(uint32_t control, Operation operation) {
  uint32_t fpscr = control;
  const uint32_t result = operation(fpscr);
  return {result, fpscr & 0x9F};
}
Flags divide(uint32_t a, uint32_t b, uint32_t control = 0) {
  return with(control, [&](uint32_t& f) { return fp::divide(a, b, f); });
}
Flags add(uint32_t a, uint32_t b, uint32_t control = 0) {
  return with(control, [&](uint32_t& f) { return fp::add(a, b, f); });
}
Flags multiply(uint32_t a, uint32_t b, uint32_t control = 0) {
  return with(control, [&](uint32_t& f) { return fp::multiply(a, b, f); });
}

TEST(McuFloat, OneThirdIsRoundedByEachOfTheFourModesAndIsInexact) {
  EXPECT_EQ(divide(kOne, kThree), (Flags{0x3EAAAAAB, fp::kInexact}));
  EXPECT_EQ(divide(kOne, kThree, kUp), (Flags{0x3EAAAAAB, fp::kInexact}));
  EXPECT_EQ(divide(kOne, kThree, kDown), (Flags{0x3EAAAAAA, fp::kInexact}));
  EXPECT_EQ(divide(kOne | kMinus, kThree, kDown), (Flags{0xBEAAAAAB, fp::kInexact}));
  EXPECT_EQ(divide(kOne, kThree, kTowardZero), (Flags{0x3EAAAAAA, fp::kInexact}));
}

TEST(McuFloat, OverflowGivesInfinityOrTheLargestNumberByTheMode) {
  EXPECT_EQ(multiply(kLargest, kTwo), (Flags{kInfinity, fp::kOverflow | fp::kInexact}));
  EXPECT_EQ(multiply(kLargest, kTwo, kTowardZero), (Flags{kLargest, fp::kOverflow | fp::kInexact}));
  EXPECT_EQ(multiply(kLargest | kMinus, kTwo, kUp), (Flags{kLargest | kMinus, fp::kOverflow | fp::kInexact}));
}

TEST(McuFloat, ExactDenormalRaisesNothingAndAnInexactOneUnderflow) {
  EXPECT_EQ(divide(kSmallestNormal, kTwo), (Flags{0x00400000, 0}));
  EXPECT_EQ(divide(kSmallest, kTwo), (Flags{0, fp::kUnderflow | fp::kInexact}));
}

TEST(McuFloat, FlushToZeroTakesDenormalOperandsAndResultsAsZero) {
  EXPECT_EQ(add(kSmallest, kOne, fp::kFlushToZero), (Flags{kOne, fp::kInputDenormal}));
  EXPECT_EQ(divide(kSmallestNormal | kMinus, kTwo, fp::kFlushToZero), (Flags{kMinus, fp::kUnderflow}));
}

TEST(McuFloat, FirstSignallingNanIsMadeQuietAndDefaultNanReplacesAll) {
  EXPECT_EQ(add(kQuiet, kSignalling), (Flags{kSignalling | 0x400000, fp::kInvalid}));
  EXPECT_EQ(add(kQuiet, kOne), (Flags{kQuiet, 0}));
  EXPECT_EQ(add(kQuiet, kOne, fp::kDefaultNan), (Flags{0x7FC00000, 0}));
  EXPECT_EQ(add(kInfinity, kInfinity | kMinus), (Flags{0x7FC00000, fp::kInvalid}));
}

TEST(McuFloat, NanThatIsSubtractedKeepsItsSign) {
  EXPECT_EQ(with(0, [](uint32_t& f) { return fp::subtract(kOne, kQuiet, f); }), (Flags{kQuiet, 0}));
}

TEST(McuFloat, DifferenceOfEqualsIsMinusZeroOnlyWhenRoundingDown) {
  EXPECT_EQ(add(kOne, kOne | kMinus), (Flags{0, 0}));
  EXPECT_EQ(add(kOne, kOne | kMinus, kDown), (Flags{kMinus, 0}));
}

TEST(McuFloat, DivisionByZeroIsInfinityWithItsOwnFlag) {
  EXPECT_EQ(divide(kOne | kMinus, 0), (Flags{kInfinity | kMinus, fp::kDivideByZero}));
  EXPECT_EQ(divide(0, 0), (Flags{0x7FC00000, fp::kInvalid}));
}

TEST(McuFloat, ConversionToIntegerSaturatesInvalidAndANanIsZero) {
  const auto to_int = [](uint32_t a, bool is_signed) {
    return with(0, [&](uint32_t& f) { return fp::to_fixed(a, 32, 0, is_signed, fp::Rounding::zero, f); });
  };
  EXPECT_EQ(to_int(0x4F000000, true), (Flags{0x7FFFFFFF, fp::kInvalid}));  // 2^31
  EXPECT_EQ(to_int(0xCF000000, true), (Flags{0x80000000, 0}));
  EXPECT_EQ(to_int(0xBF800000, false), (Flags{0, fp::kInvalid}));  // -1 - 2^-22
  EXPECT_EQ(to_int(0xBF000000, false), (Flags{0, fp::kInexact}));  // -0.5
  EXPECT_EQ(to_int(kQuiet, true), (Flags{0, fp::kInvalid}));
}

TEST(McuFloat, HalfPrecisionRoundsToElevenBitsAndTheAlternativeFormatHasNoInfinity) {
  const auto to_half = [](uint32_t a, uint32_t control) { return with(control, [&](uint32_t& f) { return fp::to_half(a, f); }); };
  EXPECT_EQ(to_half(0x3F801001, 0), (Flags{0x3C01, fp::kInexact}));  // just above half of the last bit
  EXPECT_EQ(to_half(0x477FF000, 0), (Flags{0x7C00, fp::kOverflow | fp::kInexact}));
  EXPECT_EQ(to_half(kInfinity, fp::kAlternativeHalf), (Flags{0x7FFF, fp::kInvalid}));
}

// Operands with exponents near each other, so that cancellation and rounding happen; flags are judged by the oracle test.
TEST(McuFloat, SumProductQuotientRootAndFusedProductEqualTheHostsBitForBitIn200000RandomCases) {
  uint64_t seed = 12345;
  const auto random = [&seed] {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return static_cast<uint32_t>(seed >> 33) ^ static_cast<uint32_t>(seed >> 2);
  };
  int compared = 0;
  for (int i = 0; i < 200000; ++i) {
    const auto number = [&] { return (random() & 0x807FFFFF) | (i % 8 == 0 ? random() % 255 : 100 + random() % 50) << 23; };
    const uint32_t a = number(), b = number(), c = number();
    const float fa = std::bit_cast<float>(a), fb = std::bit_cast<float>(b), fc = std::bit_cast<float>(c);
    uint32_t fpscr = 0;
    const auto same = [&](uint32_t ours, float host) {
      ++compared;
      return std::isnan(host) || ours == std::bit_cast<uint32_t>(host);
    };
    ASSERT_TRUE(same(fp::add(a, b, fpscr), fa + fb)) << std::hex << a << ' ' << b;
    ASSERT_TRUE(same(fp::subtract(a, b, fpscr), fa - fb)) << std::hex << a << ' ' << b;
    ASSERT_TRUE(same(fp::multiply(a, b, fpscr), fa * fb)) << std::hex << a << ' ' << b;
    ASSERT_TRUE(same(fp::divide(a, b, fpscr), fa / fb)) << std::hex << a << ' ' << b;
    ASSERT_TRUE(same(fp::square_root(a & ~kMinus, fpscr), std::sqrt(std::fabs(fa)))) << std::hex << a;
    ASSERT_TRUE(same(fp::multiply_add(c, a, b, fpscr), std::fma(fa, fb, fc))) << std::hex << a << ' ' << b << ' ' << c;
  }
  EXPECT_EQ(compared, 1200000);
}

// The core takes the host's operation once the inexact flag is set: result and flags must not depend on that.
TEST(McuFloat, ResultAndOtherFlagsAreTheSameWithTheInexactFlagSetBeforeOrNot) {
  Machine m;
  m.system(0xE000ED88, 0xF00000);
  uint64_t seed = 99;
  for (int i = 0; i < 20000; ++i) {
    uint32_t results[2], flags[2];
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    const auto a = static_cast<uint32_t>(seed >> 32), b = static_cast<uint32_t>(seed >> 20);
    const uint32_t first[3] = {0xEE30, 0xEE20, 0xEE80};  // VADD, VMUL, VDIV
    for (const uint32_t set : {0u, fp::kInexact}) {
      m.program({first[i % 3], 0x0A81});
      m.core.set_pc(kProgram);
      m.core.state.s[1] = a;
      m.core.state.s[2] = b;
      m.core.state.control |= 4;
      m.core.state.fpscr = set;
      m.core.update_fp_ready();
      m.instructions(1);
      results[set != 0] = m.core.state.s[0];
      flags[set != 0] = m.core.state.fpscr | fp::kInexact;
    }
    ASSERT_EQ(results[0], results[1]) << std::hex << a << ' ' << b;
    ASSERT_EQ(flags[0], flags[1]) << std::hex << a << ' ' << b;
  }
}

TEST(McuFloat, FusedProductIsRoundedOnceAndTheChainedOneTwice) {
  Machine m;
  m.system(0xE000ED88, 0xF00000);
  for (const bool fused : {true, false}) {
    m.program({fused ? 0xEEA0u : 0xEE00u, 0x0A81});  // VFMA or VMLA s0, s1, s2
    m.core.set_pc(kProgram);
    m.core.state.s[0] = 0xBF800002;                      // -1 - 2^-22
    m.core.state.s[1] = m.core.state.s[2] = 0x3F800001;  // 1 + 2^-23; its square is 1 + 2^-22 + 2^-46
    m.instructions(1);
    EXPECT_EQ(m.core.state.s[0], fused ? 0x28800000u : 0u);
  }
}

}  // namespace
}  // namespace rotorloop::mcu::testing
