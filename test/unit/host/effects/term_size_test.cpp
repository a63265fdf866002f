// Sizes that matter follow the size of the vehicle.
#include "host/effects/term_size.hpp"

#include <gtest/gtest.h>

#include "test/unit/host/effects/flown.hpp"

namespace rotorloop::host {
namespace {

TEST(TermSize, IsThatOfTheTableOnTheReferenceQuadrotor) {
  const LoadGeometry g = load_geometry(paper_vehicle());
  for (const Term& t : all_terms()) {
    for (const TermParameter& p : t.info.parameters) EXPECT_NEAR(size_ratio(p.unit, g.mass_kg, arm_m(g)), 1.0, 0.01) << t.info.id;
  }
}

TEST(TermSize, RotorInertiaOfANanoDroneOf37gIsSome200TimesSmaller) {
  // Measured: 3.9e-8 against 9.4e-6 kg m2, 240 times.
  const double ratio = size_ratio("kg m2", 0.037, 0.046);
  EXPECT_GT(1.0 / ratio, 100.0);
  EXPECT_LT(1.0 / ratio, 300.0);
}

TEST(TermSize, FollowsTheUnit) {
  const double m = 2 * kReferenceMass_kg, l = 4 * kReferenceArm_m;
  EXPECT_NEAR(size_ratio("1", m, l), 1.0, 1e-15);
  EXPECT_NEAR(size_ratio("rad", m, l), 1.0, 1e-15);
  EXPECT_NEAR(size_ratio("N", m, l), 2.0, 1e-15) << "weight";
  EXPECT_NEAR(size_ratio("kg m2", m, l), 32.0, 1e-12);
  EXPECT_NEAR(size_ratio("m/s", m, l), 2.0, 1e-15);
  EXPECT_NEAR(size_ratio("N s2/m2", m, l), 0.5, 1e-15);
  EXPECT_NEAR(size_ratio("N s^2/m^2", m, l), 0.5, 1e-15);
  EXPECT_NEAR(size_ratio("rad/(N m)", m, l), 0.125, 1e-15);
  EXPECT_NEAR(size_ratio("V", m, l), 1.0, 1e-15);
}

}  // namespace
}  // namespace rotorloop::host
