// What of a sum that runs off is determined all the same: ratios by the joint covariance of a fit.
#include "bench/sysid/diagnose/ratios.hpp"

#include <gtest/gtest.h>

#include "bench/sysid/estimate/model/parameters.hpp"

namespace rotorloop::diagnose {
namespace {

const host::TermList kNoTerms;

// A fit of c_q and I_zz as yaw alone leaves it: each uncertain by `alone`, relative, both by one common scale, and the ratio by `apart`.
estimate::Fit yaw_fit(double alone, double apart) {
  estimate::Fit fit;
  const double c_q = 2e-10, inertia = 4e-5;
  fit.estimates = {{.parameter = estimate::kCq, .value = c_q}, {.parameter = estimate::kIzz, .value = inertia}};
  const double common = alone * alone - 0.5 * apart * apart;
  fit.covariance.resize(2, 2);
  fit.covariance << alone * alone * c_q * c_q, common * c_q * inertia, common * c_q * inertia, alone * alone * inertia * inertia;
  fit.robust_covariance = 0.25 * fit.covariance;
  return fit;
}

TEST(FirmRatios, ARatioKnownTo2percentOfFiguresThatRunOffTogetherBy30IsReportedWithItsUncertainty) {
  const auto ratios = well_determined_ratios(yaw_fit(0.3, 0.02), estimate::kCq, kNoTerms);
  ASSERT_EQ(ratios.size(), 1u);
  EXPECT_EQ(ratios[0].name, "c_q / I_zz");
  EXPECT_NEAR(ratios[0].value, 2e-10 / 4e-5, 1e-12);
  EXPECT_NEAR(ratios[0].u / ratios[0].value, 0.02, 1e-6);
  EXPECT_EQ(ratios_text(ratios), "c_q / I_zz = 5.00e-06 ± 1.0e-07 (N m s2)/(kg m2)");
}

TEST(FirmRatios, ARatioNoBetterKnownThanTheFigureItselfIsNotReported) {
  EXPECT_TRUE(well_determined_ratios(yaw_fit(0.03, 0.02), estimate::kCq, kNoTerms).empty());
}

TEST(FirmRatios, TheLargerOfTheClassicalAndTheRobustUncertaintyCounts) {
  estimate::Fit fit = yaw_fit(0.3, 0.02);
  fit.robust_covariance = 4.0 * fit.covariance;
  const auto ratios = well_determined_ratios(fit, estimate::kCq, kNoTerms);
  ASSERT_EQ(ratios.size(), 1u);
  EXPECT_NEAR(ratios[0].u / ratios[0].value, 0.04, 1e-6);
}

TEST(FirmRatios, FiguresOfSingleFlightsAndScalesThatAreHeldMakeNone) {
  estimate::Fit fit = yaw_fit(0.3, 0.02);
  EXPECT_TRUE(well_determined_ratios(fit, estimate::kIxx, kNoTerms).empty());
  fit.estimates[1].flight = 0;
  EXPECT_TRUE(well_determined_ratios(fit, estimate::kCq, kNoTerms).empty());
}

}  // namespace
}  // namespace rotorloop::diagnose
