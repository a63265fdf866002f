// The C library serves as the independent reference: it may differ by CPU in the last bit, never by more than a few ulp.
#include "host/base/elementary.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace rotorloop {
namespace {

double ulp(double x) { return std::nextafter(std::fabs(x), INFINITY) - std::fabs(x); }

TEST(Elementary, SinAndCosStayWithin2e16OfTheLibraryUpTo1000Radians) {
  for (int i = -200000; i <= 200000; ++i) {
    const double x = i * 0.005 + i * 1e-7;
    const auto sc = sincos_exact(x);
    ASSERT_NEAR(sc.sin, std::sin(x), 2.5e-16) << x;
    ASSERT_NEAR(sc.cos, std::cos(x), 2.5e-16) << x;
  }
}
TEST(Elementary, Atan2AgreesWithin3UlpInAllQuadrants) {
  for (int i = 0; i < 20000; ++i) {
    const double a = -3.14159 + i * 3.14159e-4;
    const double r = 1e-3 * (1 + i % 977);
    const double y = r * std::sin(a), x = r * std::cos(a);
    const double expected = std::atan2(y, x);
    ASSERT_NEAR(atan2_exact(y, x), expected, 4 * ulp(expected) + 1e-16) << a;
  }
  EXPECT_EQ(atan2_exact(0.0, 1.0), 0.0);
  EXPECT_EQ(atan2_exact(0.0, -1.0), std::atan2(0.0, -1.0));
  EXPECT_EQ(atan2_exact(-0.0, -1.0), std::atan2(-0.0, -1.0));
  EXPECT_EQ(atan2_exact(2.0, 0.0), std::atan2(2.0, 0.0));
}
TEST(Elementary, ExpAndLogAgreeWithin4UlpAndInvertEachOther) {
  for (int i = -6000; i <= 6000; ++i) {
    const double x = i * 0.1;
    ASSERT_NEAR(exp_exact(x) / std::exp(x), 1.0, 2e-15) << x;
    const double y = std::exp(x);
    ASSERT_NEAR(log_exact(y), std::log(y), 4 * ulp(std::log(y)) + 1e-16) << x;
  }
  EXPECT_EQ(log_exact(1.0), 0.0);
  EXPECT_TRUE(std::isinf(log_exact(0.0)));
  EXPECT_TRUE(std::isnan(log_exact(-1.0)));
  EXPECT_EQ(exp_exact(0.0), 1.0);
}
TEST(Elementary, AsinAndAcosAreExactAtTheEnds) {
  EXPECT_NEAR(asin_exact(1.0), std::numbers::pi / 2, 1e-16);
  EXPECT_NEAR(acos_exact(-1.0), std::numbers::pi, 1e-15);
  for (int i = -999; i <= 999; ++i) ASSERT_NEAR(asin_exact(i * 1e-3), std::asin(i * 1e-3), 4e-16);
}

}  // namespace
}  // namespace rotorloop
