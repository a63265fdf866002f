// Readers of QPROP's files, on files written here.
#include "bench/propeller/oracles/qprop_case.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::propeller {
namespace {
const std::string kDefinition = R"(!USAGE: a comment
2 blades of some make

 2   3.05  ! Nblades  [ R ]
 0.5  5.8  ! CL0 CL_a
 -0.3 1.2
 0.028 0.05 0.02 0.5
 70000 -0.7
 0.0254 0.0254 1.0
 0. 0. 1.0  ! Radd Cadd Badd
# r chord beta
 0.75 0.66 27 ! root
 1.5  0.63 15
 3.0  0.19 4
)";
const std::string kListing = R"(> qprop some prop 5.0 14020
# QPROP Version 1.22
#   0.31000     R  (Ohm)
#   rho =  1.2250     kg/m^3
#   mu  = 0.18100E-04 kg/m-s
#   a   =  340.00     m/s
#  1  2  3  4  5  6  7  8  9  10  11  12  13  14  15  16  17  18  19
#  V(m/s) rpm Dbeta T(N) Q(N-m)
#   5.000  0.1402E+05  0.000   2.644  0.2880E-01  42.29  7.8  9.0  0.58  0.3  0.04  0.1  0.2  11.1  0.18  71.8  13.2  0.6  0.03
#
#  radius chord beta Cl Cd Re Mach effi effp Wa(m/s) Aswirl adv_wake
   0.0202  0.0170  26.380   1.0741  0.07383    33942  0.087   0.4452   0.8244   10.45       11.18      0.1004
   0.0225  0.0173  24.311   1.0231  0.06331    38523  0.097   0.4353   0.8308   10.79       10.58      0.1027
)";
std::string without(std::string text, const std::string& part) { return text.erase(text.find(part), part.size()); }

TEST(QpropDefinition, ScalesAndOffsetsStationsAndSkipsTheTitleEvenWhenItStartsWithANumber) {
  const test::TempFolder folder;
  const QpropDefinition d = read_qprop_definition(folder.write("a.def", kDefinition));
  EXPECT_EQ(d.blades, 2);
  EXPECT_EQ(d.r_m.size(), 3u);
  EXPECT_DOUBLE_EQ(d.r_m.front(), 0.75 * 0.0254);
  EXPECT_DOUBLE_EQ(d.chord_m.back(), 0.19 * 0.0254);
  EXPECT_DOUBLE_EQ(d.beta_deg.front(), 28.0);
  EXPECT_DOUBLE_EQ(d.polar.cl_max, 1.2);
  EXPECT_DOUBLE_EQ(d.polar.reynolds_exponent, -0.7);
}
TEST(QpropDefinition, StripsAreOfEqualWidthFromTheFirstToTheLastStation) {
  const test::TempFolder folder;
  const auto g = qprop_geometry(read_qprop_definition(folder.write("a.def", kDefinition)), 25);
  ASSERT_EQ(g.elements.size(), 25u);
  EXPECT_DOUBLE_EQ(g.radius_m, 3.0 * 0.0254);
  EXPECT_NEAR(g.elements.front().r_m, (0.75 + 0.5 * 2.25 / 25) * 0.0254, 1e-12);
  EXPECT_NEAR(g.elements.back().r_m + 0.5 * g.elements.back().width_m, g.radius_m, 1e-12);
}
TEST(QpropDefinition, NamesTheLineThatIsShortOrOutOfOrder) {
  const test::TempFolder folder;
  const auto message = [&](const std::string& text) { return test::error_of([&] { read_qprop_definition(folder.write("b.def", text)); }); };
  EXPECT_NE(message(without(kDefinition, " 0.02 0.5")).find("b.def:7: error: 2 numbers, expected 4"), std::string::npos);
  EXPECT_NE(message(without(kDefinition, " 0.63 15")).find("b.def:13: error: a station needs"), std::string::npos);
  EXPECT_NE(message(without(kDefinition, "1.5  ")).find("b.def:13: error: a station needs"), std::string::npos);
  EXPECT_NE(message(without(kDefinition, " 3.0  0.19 4\n")).find("three stations"), std::string::npos);
  EXPECT_NE(test::error_of([&] { read_qprop_definition(folder.path() / "none.def"); }).find("cannot be opened"), std::string::npos);
}

TEST(QpropListing, GivesConstantsOperatingPointAndStations) {
  const test::TempFolder folder;
  const QpropListing q = read_qprop_listing(folder.write("a.txt", kListing));
  EXPECT_DOUBLE_EQ(q.density_kg_m3, 1.225);
  EXPECT_DOUBLE_EQ(q.sound_speed_m_s, 340.0);
  EXPECT_DOUBLE_EQ(q.speed_m_s, 5.0);
  EXPECT_DOUBLE_EQ(q.rpm, 14020.0);
  EXPECT_DOUBLE_EQ(q.thrust_N, 2.644);
  EXPECT_DOUBLE_EQ(q.torque_N_m, 0.0288);
  ASSERT_EQ(q.stations.size(), 2u);
  EXPECT_DOUBLE_EQ(q.stations[1].cl, 1.0231);
  EXPECT_DOUBLE_EQ(q.stations[1].axial_m_s, 10.79);
}
TEST(QpropListing, WithoutConstantsOrStationsIsRefused) {
  const test::TempFolder folder;
  const auto message = [&](const std::string& text) { return test::error_of([&] { read_qprop_listing(folder.write("b.txt", text)); }); };
  EXPECT_NE(message(without(kListing, "#   a   =  340.00     m/s\n")).find("# a ="), std::string::npos);
  EXPECT_NE(message(kListing.substr(0, kListing.find("   0.0202"))).find("no operating point with its stations"), std::string::npos);
}

TEST(CubicSpline, ReproducesAParabolaExactly) {
  const auto f = [](double x) { return 1.0 - 2.0 * x + 3.0 * x * x; };
  const CubicSpline s({0.0, 0.5, 0.7, 1.5}, {f(0.0), f(0.5), f(0.7), f(1.5)});
  for (double x : {0.0, 0.2, 0.6, 1.1, 1.5}) EXPECT_NEAR(s(x), f(x), 1e-12);
}
}  // namespace
}  // namespace rotorloop::propeller
