// What a geometry file of the UIUC database or of APC may say, and what is answered when it is wrong.
#include "bench/propeller/geometry.hpp"

#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {
using namespace fixtures;
using ::testing::AllOf;
using ::testing::HasSubstr;

PropellerGeometry uiuc(const std::string& text) { return read_uiuc_geometry(TextFile::parse(text, "geom.txt"), 0.0635, 2); }
PropellerGeometry mould(const std::string& text) { return read_apc_mould(TextFile::parse(text, "x.PE0")); }
std::string uiuc_message(const std::string& from, const std::string& to) {
  return message([&] { uiuc(replaced(kGeometry, from, to)); });
}
std::string mould_message(const std::string& from, const std::string& to) {
  return message([&] { mould(replaced(kMould, from, to)); });
}

TEST(UiucGeometry, RatiosToTheRadiusBecomeMetres) {
  const PropellerGeometry g = uiuc(kGeometry);
  ASSERT_EQ(g.stations.size(), 5u);
  EXPECT_DOUBLE_EQ(g.stations[3].r_m, 0.75 * 0.0635);
  EXPECT_DOUBLE_EQ(g.stations[3].chord_m, 0.180 * 0.0635);
  EXPECT_DOUBLE_EQ(g.stations[3].twist_deg, 18.9);
  EXPECT_DOUBLE_EQ(g.hub_radius_m, 0.15 * 0.0635);
  EXPECT_FALSE(g.sections.has_value());
}
TEST(UiucGeometry, CarriageReturnsTrailingBlanksAndAByteOrderMarkAreForgiven) {
  EXPECT_EQ(uiuc("\xEF\xBB\xBF" + with_carriage_returns(kGeometry) + "\r\n \r\n").stations.size(), 5u);
}
TEST(UiucGeometry, ErrorsNameFileLineValueAndRemedy) {
  EXPECT_THAT(uiuc_message("0.50  0.178", "0.30  0.178"),
              AllOf(HasSubstr("geom.txt:4"), HasSubstr("r/R = 0.3"), HasSubstr("does not exceed"), HasSubstr("do:")));
}
TEST(UiucGeometry, FallingRadiusIsRefused) { EXPECT_THAT(uiuc_message("0.50  0.178", "0.20  0.178"), HasSubstr("does not exceed")); }
TEST(UiucGeometry, ChordInMillimetresIsRefused) {
  EXPECT_THAT(uiuc_message("0.178", "11.30"), AllOf(HasSubstr("c/R = 11.3"), HasSubstr("radii")));
}
TEST(UiucGeometry, ChordWiderThanTheRadiusIsRefused) { EXPECT_THAT(uiuc_message("0.178", "1.20"), HasSubstr("c/R = 1.2 is outside")); }
TEST(UiucGeometry, RadiusInMillimetresIsRefused) {
  EXPECT_THAT(uiuc_message("1.00  0.022", "63.5  0.022"), HasSubstr("r/R = 63.5 is outside"));
}
TEST(UiucGeometry, NotANumberIsRefused) { EXPECT_THAT(uiuc_message("25.8", "nan"), HasSubstr("beta = \"nan\" is not a finite number")); }
TEST(UiucGeometry, InfinityIsRefused) { EXPECT_THAT(uiuc_message("25.8", "inf"), HasSubstr("is not a finite number")); }
TEST(UiucGeometry, DecimalCommaIsRefused) { EXPECT_THAT(uiuc_message("25.8", "25,8"), HasSubstr("\"25,8\" is not a finite number")); }
TEST(UiucGeometry, RowCutOffIsRefused) {
  EXPECT_THAT(uiuc_message("  15.5", ""), AllOf(HasSubstr("geom.txt:6"), HasSubstr("beta is missing")));
}
TEST(UiucGeometry, ExtraFieldIsRefused) { EXPECT_THAT(uiuc_message("15.5", "15.5 0.1"), HasSubstr("4 fields where the header has 3")); }
TEST(UiucGeometry, UnknownColumnIsRefused) { EXPECT_THAT(uiuc_message("beta", "beta sweep"), HasSubstr("expected \"r/R c/R beta\"")); }
TEST(UiucGeometry, SwappedColumnsAreRefused) {
  EXPECT_THAT(uiuc_message("c/R     beta", "beta    c/R"), HasSubstr("expected \"r/R c/R beta\""));
}
TEST(UiucGeometry, MissingHeaderIsRefused) {
  EXPECT_THAT(uiuc_message("r/R   c/R     beta\n", ""), HasSubstr("columns are \"0.15 0.120 41.4\""));
}
TEST(UiucGeometry, MissingTipIsRefused) {
  EXPECT_THAT(uiuc_message("1.00  0.022", "0.90  0.022"), HasSubstr("last station is at r/R = 0.9"));
}
TEST(UiucGeometry, MissingRootIsRefused) {
  EXPECT_THAT(uiuc_message("0.15  0.120  41.4\n0.30", "0.35  0.120  41.4\n0.40"), HasSubstr("first station is at r/R = 0.35"));
}
TEST(UiucGeometry, TooFewStationsAreRefused) {
  EXPECT_THAT(uiuc_message("0.30  0.159  36.4\n", ""), HasSubstr("4 rows, expected at least 5"));
}
TEST(UiucGeometry, EmptyFileIsRefused) {
  for (const std::string text : {"", "\r\n  \r\n", "\xEF\xBB\xBF"})
    EXPECT_THAT(message([&] { uiuc(text); }), HasSubstr("the file is empty"));
}
TEST(UiucGeometry, MissingFileIsRefused) {
  EXPECT_THAT(message([] { TextFile::read("no/such/file.txt"); }), AllOf(HasSubstr("no/such/file.txt"), HasSubstr("cannot be read")));
}

TEST(ApcMould, InchesBecomeMetresAndTheTailGivesBladesInertiaAndSections) {
  const PropellerGeometry g = mould(kMould);
  ASSERT_EQ(g.stations.size(), 6u);  // the row at the hub transition stands there twice
  EXPECT_NEAR(g.stations[2].r_m, 0.0254, 1e-12);
  EXPECT_NEAR(g.stations[2].chord_m, 0.40 * 0.0254, 1e-12);
  EXPECT_DOUBLE_EQ(g.stations[2].twist_deg, 34.0);
  EXPECT_DOUBLE_EQ(*g.stations[2].thickness_ratio, 0.15);
  EXPECT_NEAR(g.radius_m, 2.09 * 0.0254, 1e-12);
  EXPECT_NEAR(g.hub_radius_m, 0.50 * 0.0254, 1e-12);
  EXPECT_EQ(g.blades, 2);
  EXPECT_DOUBLE_EQ(*g.inertia_kg_m2, 4.2e-5);
  EXPECT_EQ(g.sections->inner, "E63");
  EXPECT_EQ(g.sections->outer, "APC12");
  EXPECT_NEAR(g.sections->blend_to_m, 2.00 * 0.0254, 1e-12);
}
TEST(ApcMould, CarriageReturnsAreForgiven) { EXPECT_EQ(mould(with_carriage_returns(kMould)).stations.size(), 6u); }
TEST(ApcMould, InertiaBelowTheDigitsOfTheFileIsNotGiven) {
  EXPECT_FALSE(mould(replaced(kMould, "0.000042", "0.000000")).inertia_kg_m2.has_value());
}
TEST(ApcMould, MillimetresAreRefused) {
  EXPECT_THAT(mould_message("(IN)       (IN)", "(MM)       (MM)"), HasSubstr("units are \"(MM) (MM)"));
}
TEST(ApcMould, UnknownColumnIsRefused) { EXPECT_THAT(mould_message("ZHIGH", "ZLOW"), HasSubstr("columns are")); }
TEST(ApcMould, ExtraColumnIsRefused) { EXPECT_THAT(mould_message("CGY  CGZ", "CGX  CGY  CGZ"), HasSubstr("columns are")); }
TEST(ApcMould, FallingRadiusIsRefused) {
  EXPECT_THAT(mould_message("      1.500000", "      0.900000"),
              AllOf(HasSubstr("x.PE0:10"), HasSubstr("STATION = 0.9 in does not exceed")));
}
TEST(ApcMould, NotANumberIsRefused) { EXPECT_THAT(mould_message("24.400000", "nan"), HasSubstr("TWIST = \"nan\"")); }
TEST(ApcMould, RowCutOffIsRefused) {
  EXPECT_THAT(mould_message(" 0.05 0.02 0.08 0.10 -0.01\n\n", "\n\n"), HasSubstr("8 fields where the header has 13"));
}
TEST(ApcMould, FileCutOffBelowTheTableIsRefused) {
  EXPECT_THAT(message([] { mould(kMould.substr(0, kMould.find(" RADIUS"))); }), HasSubstr("no line \"RADIUS:\""));
}
TEST(ApcMould, FileCutOffWithinTheTableIsRefused) {
  EXPECT_THAT(message([] { mould(kMould.substr(0, kMould.find("      1.500000"))); }), HasSubstr("3 stations, expected at least 5"));
  EXPECT_THAT(message([] { mould(replaced(replaced(kMould, mould_row(2.00, 0.19, 17.0), ""), mould_row(2.09, 0.01, 13.8), "")); }),
              HasSubstr("4 stations"));
}
TEST(ApcMould, TipThatIsNotTheRadiusIsRefused) {
  EXPECT_THAT(mould_message("RADIUS:  2.09", "RADIUS:  4.20"), HasSubstr("RADIUS is 4.2 in"));
}
TEST(ApcMould, NineBladesAreRefused) { EXPECT_THAT(mould_message("BLADES:  2", "BLADES:  9"), HasSubstr("BLADES: = 9 is outside 1 to 8")); }
TEST(ApcMould, FileWithoutTableIsRefused) {
  EXPECT_THAT(message([] { mould("a letter\n"); }), HasSubstr("no table of stations"));
}
TEST(ApcMould, EmptyFileIsRefused) {
  EXPECT_THAT(message([] { mould(""); }), HasSubstr("the file is empty"));
}

}  // namespace
}  // namespace rotorloop::propeller
