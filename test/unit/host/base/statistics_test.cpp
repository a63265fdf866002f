// Distributions against tables (Abramowitz and Stegun 1964: 26.7 χ², 26.9 F, 26.10 t), order statistics against small samples by hand.
#include "host/base/statistics.hpp"

#include <gtest/gtest.h>

namespace rotorloop {
namespace {

TEST(Statistics, TailOfChiSquareIsThatOfTables) {
  EXPECT_NEAR(chi_square_tail(3.841, 1), 0.05, 1e-4);
  EXPECT_NEAR(chi_square_tail(18.307, 10), 0.05, 1e-4);
  EXPECT_NEAR(chi_square_tail(124.342, 100), 0.05, 1e-4);
  EXPECT_NEAR(chi_square_tail(29.588, 10), 0.001, 1e-5);
  EXPECT_DOUBLE_EQ(chi_square_tail(0.0, 3), 1.0);
}

TEST(Statistics, TailOfTheNormalDistributionIsThatOfTables) {
  EXPECT_NEAR(normal_two_sided(1.959964), 0.05, 1e-6);
  EXPECT_NEAR(normal_two_sided(-2.575829), 0.01, 1e-6);
}

TEST(Statistics, TailOfFIsThatOfTables) {
  EXPECT_NEAR(f_tail(4.9646, 1.0, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(4.1028, 2.0, 10.0), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(6.6349, 1.0, 1e7), 0.01, 1e-5);
  EXPECT_EQ(f_tail(0.0, 3.0, 20.0), 1.0);
}

TEST(Statistics, QuantilesOfStudentsTAreThoseOfTablesAndTendToTheNormalOnes) {
  constexpr double kDigits = 5e-4;  // tables have three
  EXPECT_NEAR(student_quantile(0.95, 1), 12.706, kDigits);
  EXPECT_NEAR(student_quantile(0.95, 7), 2.365, kDigits);
  EXPECT_NEAR(student_quantile(0.95, 30), 2.042, kDigits);
  EXPECT_NEAR(student_quantile(0.99, 1), 63.657, kDigits);
  EXPECT_NEAR(student_quantile(0.99, 9), 3.250, kDigits);
  EXPECT_NEAR(student_quantile(0.99, 60), 2.660, kDigits);
  EXPECT_NEAR(student_quantile(0.99, 1e9), 2.576, kDigits);
  EXPECT_EQ(student_quantile(0.99, 0.2), student_quantile(0.99, 1));
}

TEST(Statistics, QuantilesAreValuesOfTheSampleNextToTheirRank) {
  EXPECT_EQ(median({5, 1, 4}), 4);
  EXPECT_EQ(median({5, 1, 4, 3}), 4);
  EXPECT_EQ(quantile({5, 1, 4, 3}, 0.0), 1);
  EXPECT_EQ(quantile({5, 1, 4, 3}, 1.0), 5);
  EXPECT_EQ(quantile({}, 0.5), 0);
  EXPECT_EQ(median_step(std::vector<double>{0, 1, 3, 10}), 2);
  EXPECT_EQ(median_step(std::vector<double>{4}), 0);
}

TEST(Statistics, TheRobustDeviationIgnoresAWildValue) { EXPECT_DOUBLE_EQ(robust_deviation({1, 2, 3, 4, 1e9}), 1.4826); }

// Holm's step-down by hand: 0.01, 0.04, 0.03, 0.005 become 0.03, 0.06, 0.06, 0.02.
TEST(Statistics, HolmStepsDown) {
  const std::vector<double> adjusted = holm(std::vector<double>{0.01, 0.04, 0.03, 0.005});
  EXPECT_NEAR(adjusted[0], 0.03, 1e-12);
  EXPECT_NEAR(adjusted[1], 0.06, 1e-12);
  EXPECT_NEAR(adjusted[2], 0.06, 1e-12);
  EXPECT_NEAR(adjusted[3], 0.02, 1e-12);
}

}  // namespace
}  // namespace rotorloop
