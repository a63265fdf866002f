// Numbers with the digits that their uncertainty allows.
#include "bench/render/digits.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop::render {
namespace {

TEST(Digits, ValueEndsAtTheSecondDigitOfItsUncertainty) {
  EXPECT_EQ(measured_text(4.32871, 0.0123), "4.329 ± 0.012");
  EXPECT_EQ(measured_text(0.017512, 0.00037), "0.01751 ± 0.00037");
  EXPECT_EQ(measured_text(5.1, 0.2), "5.10 ± 0.20");
  EXPECT_EQ(measured_text(-1.23456, 0.5), "-1.23 ± 0.50");
}
TEST(Digits, UncertaintyThatRoundsUpKeepsTwoDigits) {
  EXPECT_EQ(measured_text(1.0, 0.0996), "1.00 ± 0.10");
  EXPECT_EQ(measured_text(8951.2, 99.6), "8950 ± 100");
}
TEST(Digits, LargeUncertaintyRoundsBeforeThePoint) {
  EXPECT_EQ(measured_text(12345.6, 340.0), "12350 ± 340");
  EXPECT_EQ(measured_text(12.0, 3400.0), "0 ± 3400") << "the value is nothing at the place of its uncertainty";
}
TEST(Digits, SmallAndLargeNumbersHaveAnExponent) {
  EXPECT_EQ(measured_text(4.3271e-8, 1.23e-10), "4.327e-08 ± 1.2e-10");
  EXPECT_EQ(measured_text(2.1e-9, 1.2e-8), "2e-09 ± 1.2e-08");
  EXPECT_EQ(measured_text(3.4e7, 2.0e5), "3.400e+07 ± 200000");
}
TEST(Digits, WithoutUncertaintyThereAreFourDigits) {
  EXPECT_EQ(measured_text(0.0175123, 0.0), "0.01751");
  EXPECT_EQ(measured_text(0.0175123, std::nan("")), "0.01751");
}
TEST(Digits, UncertaintyThatIsRoundingAloneAddsNoDigits) { EXPECT_EQ(measured_text(0.0055, 1.5e-19), "0.0055 ± 1.5e-19"); }
TEST(Digits, ValueFarAboveItsUncertaintyIsNotCutShort) { EXPECT_EQ(measured_text(1.23456789, 1e-6), "1.2345679 ± 1.0e-06"); }

}  // namespace
}  // namespace rotorloop::render
