// Section polars from XFLR5: what is read and refused, and how they go on over the full circle.
#include <cmath>

#include "bench/propeller/full_circle.hpp"
#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {
using namespace fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;

SectionPolar polar(const std::string& text) { return read_xflr5_polar(TextFile::parse(text, "polar.txt")); }
std::string polar_message(const std::string& from, const std::string& to) {
  return message([&] { polar(replaced(polar_text(), from, to)); });
}

TEST(Xflr5Polar, NameReynoldsNumberAndPointsAreRead) {
  const SectionPolar p = polar(with_carriage_returns(polar_text("E63  (4.25%)", 0.080)));
  EXPECT_EQ(p.airfoil, "E63  (4.25%)");
  EXPECT_DOUBLE_EQ(p.reynolds, 80e3);
  EXPECT_DOUBLE_EQ(p.n_crit, 6.0);
  ASSERT_EQ(p.alpha_deg.size(), 61u);
  EXPECT_DOUBLE_EQ(p.alpha_deg.front(), -15.0);
  EXPECT_DOUBLE_EQ(p.cl.back(), 1.0);
}
TEST(Xflr5Polar, RepeatedAngleIsRefusedWithItsLine) {
  EXPECT_THAT(polar_message(" -14.500000", " -15.000000"), AllOf(HasSubstr("polar.txt:13"), HasSubstr("alpha = -15 deg does not exceed")));
}
TEST(Xflr5Polar, UnknownColumnsAreRefused) { EXPECT_THAT(polar_message("CDp       Cm", "Cm        CDp"), HasSubstr("unknown columns")); }
TEST(Xflr5Polar, ExtraFieldIsRefused) { EXPECT_THAT(polar_message("0.25\n", "0.25 7\n"), HasSubstr("13 fields")); }
TEST(Xflr5Polar, RowCutOffIsRefused) {
  const std::string text = polar_text();
  EXPECT_THAT(message([&] { polar(text.substr(0, text.size() - 45)); }), HasSubstr("fields, expected 7 to 12"));
}
TEST(Xflr5Polar, NotANumberIsRefused) { EXPECT_THAT(polar_message("0.132500", "nan"), HasSubstr("CD = \"nan\"")); }
TEST(Xflr5Polar, NegativeDragIsRefused) { EXPECT_THAT(polar_message("0.132500", "-0.1325"), HasSubstr("CD = -0.1325 is outside")); }
TEST(Xflr5Polar, MissingReynoldsNumberIsRefused) { EXPECT_THAT(polar_message("Re =", "Rx ="), HasSubstr("Re = …")); }
TEST(Xflr5Polar, ReynoldsNumberNotInMillionsIsRefused) { EXPECT_THAT(polar_message(" e 6", " e 3"), HasSubstr("not given in millions")); }
TEST(Xflr5Polar, MissingTableIsRefused) { EXPECT_THAT(polar_message("  alpha", "  angle"), HasSubstr("no table")); }
TEST(Xflr5Polar, FileCutOffBeforePositiveAnglesIsRefused) {
  EXPECT_THAT(message([] { polar(polar_text("x", 0.03, -15.0, 2.0)); }), HasSubstr("covers -15 to 2 deg"));
}
TEST(Xflr5Polar, EmptyFileIsRefused) {
  EXPECT_THAT(message([] { polar(" \n"); }), HasSubstr("the file is empty"));
}

TEST(Viterna, MeetsTheLastComputedPointAndIsAFlatPlateAt90Degrees) {
  const auto at_match = viterna(14.0, 0.9, 0.16, 14.0), broadside = viterna(14.0, 0.9, 0.16, 90.0);
  EXPECT_NEAR(at_match.cl, 0.9, 1e-12);
  EXPECT_NEAR(at_match.cd, 0.16, 1e-12);
  EXPECT_NEAR(broadside.cl, 0.0, 1e-12);
  EXPECT_NEAR(broadside.cd, 1.2, 1e-12);
}

class FullCircle : public ::testing::Test {
 protected:
  sim::Polar circle = full_circle({polar(polar_text("a", 0.060)), polar(polar_text("a", 0.030))});
};
TEST_F(FullCircle, TablesAreOrderedByReynoldsNumber) {
  ASSERT_EQ(circle.tables.size(), 2u);
  EXPECT_DOUBLE_EQ(circle.tables[0].reynolds, 30e3);
  EXPECT_DOUBLE_EQ(circle.tables[1].reynolds, 60e3);
}
TEST_F(FullCircle, ComputedPointsStayAsTheyAre) {
  const auto c = sim::polar_at(circle, 6.25, 30e3);
  EXPECT_NEAR(c.cl, 0.625, 1e-9);
  EXPECT_NEAR(c.cd, 0.5 * (0.02 + 0.0005 * 36.0 + 0.02 + 0.0005 * 42.25), 1e-9);
}
// Steps of 0.05 degrees over the circle. The steepest real part is the mirrored section near 180 degrees, 0.35 of lift in 15 degrees,
// and attached flow, 0.1 per degree.
TEST_F(FullCircle, LiftAndDragNeverJumpBetweenNeighbouringAnglesNorAcross180Degrees) {
  auto last = sim::polar_at(circle, 180.0, 30e3);
  for (int i = 0; i <= 7200; ++i) {
    const auto c = sim::polar_at(circle, -180.0 + 0.05 * i, 30e3);
    ASSERT_LT(std::fabs(c.cl - last.cl), 0.011) << -180.0 + 0.05 * i;
    ASSERT_LT(std::fabs(c.cd - last.cd), 0.004) << -180.0 + 0.05 * i;
    ASSERT_GT(c.cd, 0.0);
    last = c;
  }
}
TEST_F(FullCircle, FlowFromBehindLiftsTheOtherWayAndWeaker) {
  EXPECT_NEAR(sim::polar_at(circle, 160.0, 30e3).cl, -0.7 * sim::polar_at(circle, 20.0, 30e3).cl, 1e-9);
}
TEST_F(FullCircle, IsAPolarThatTheFileReaderWouldAccept) {
  EXPECT_EQ(circle.alpha_deg.front(), -180.0);
  EXPECT_EQ(circle.alpha_deg.back(), 180.0);
  for (std::size_t i = 1; i < circle.alpha_deg.size(); ++i) ASSERT_GT(circle.alpha_deg[i], circle.alpha_deg[i - 1]);
  for (const auto& t : circle.tables) {
    EXPECT_EQ(t.cl.size(), circle.alpha_deg.size());
    EXPECT_DOUBLE_EQ(t.cl.front(), t.cl.back());
    EXPECT_DOUBLE_EQ(t.cd.front(), t.cd.back());
  }
}
TEST_F(FullCircle, BlendOfTwoSectionsLiesBetweenThemByItsWeight) {
  auto other = circle;
  for (double& cl : other.tables[0].cl) cl += 0.4;
  EXPECT_NEAR(sim::polar_at(blend(circle, other, 0.25), 5.0, 30e3).cl, 0.5 + 0.1, 1e-12);
}
TEST_F(FullCircle, TablesAboveTheFirstThatReachesAReynoldsNumberAreDropped) {
  EXPECT_EQ(up_to(circle, 25e3).tables.size(), 1u);
  EXPECT_EQ(up_to(circle, 31e3).tables.size(), 2u);
  EXPECT_EQ(up_to(circle, 1e6).tables.size(), 2u);
}
TEST(FullCircleInput, HoleOfMoreThan5DegreesEndsTheComputedBranch) {
  SectionPolar p = polar(polar_text());
  const auto cut = [&](double from, double to) {
    for (std::size_t i = p.alpha_deg.size(); i-- > 0;)
      if (p.alpha_deg[i] > from && p.alpha_deg[i] < to) {
        for (auto* v : {&p.alpha_deg, &p.cl, &p.cd}) v->erase(v->begin() + static_cast<std::ptrdiff_t>(i));
      }
  };
  cut(-14.5, -6.0);  // the point at -14.5 is no longer trusted
  const double expected = -viterna(6.0, 0.6, 0.02 + 0.0005 * 36.0, 14.5).cl;
  EXPECT_NEAR(sim::polar_at(full_circle({p}), -14.5, 30e3).cl, expected, 1e-9);
}
TEST(FullCircleInput, TwoFilesOfOneReynoldsNumberAreRefused) {
  EXPECT_THAT(message([] { full_circle({polar(polar_text()), polar(polar_text())}); }), HasSubstr("Reynolds number 30000 is given twice"));
}
TEST(FullCircleInput, FilesOfTwoAirfoilsAreRefused) {
  EXPECT_THAT(message([] { full_circle({polar(polar_text("a", 0.03)), polar(polar_text("b", 0.06))}); }), HasSubstr("are mixed"));
}
TEST(FullCircleInput, NoFileIsRefused) {
  EXPECT_THAT(message([] { full_circle({}); }), HasSubstr("none given"));
}

}  // namespace
}  // namespace rotorloop::propeller
