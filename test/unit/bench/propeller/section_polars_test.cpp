// Polars from XFOIL: sections from digits and files, the branch that is used of its points, and what is kept. XFOIL itself is stood in for
// by a thin section here; the real one is run by integration_rotor_fit.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "bench/propeller/fit/blade_files.hpp"
#include "bench/propeller/full_circle.hpp"
#include "bench/propeller/polar/polar_cache.hpp"
#include "bench/propeller/polar/section_sweeps.hpp"
#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {

using fixtures::message;
using ::testing::HasSubstr;

// NACA 0012 with 2 % of camber along a half sine, `n` points a side.
std::pair<double, double> surface(double x, bool upper) {
  const double half = 0.6 * (0.2969 * std::sqrt(x) - 0.1260 * x - 0.3516 * x * x + 0.2843 * x * x * x - 0.1015 * x * x * x * x);
  return {x, 0.02 * std::sin(std::numbers::pi * x) + (upper ? half : -half)};
}
std::vector<std::pair<double, double>> side(bool upper, int n = 30) {  // from the leading edge
  std::vector<std::pair<double, double>> points;
  for (int i = 0; i <= n; ++i) points.push_back(surface(0.5 * (1.0 - std::cos(std::numbers::pi * i / n)), upper));
  return points;
}
std::string rows(const std::vector<std::pair<double, double>>& points) {
  std::string s;
  for (const auto& [x, y] : points) s += std::to_string(x) + " " + std::to_string(y) + "\n";
  return s;
}
std::string selig() {
  auto upper = side(true), lower = side(false);
  std::reverse(upper.begin(), upper.end());
  lower.erase(lower.begin());
  return "My section\n" + rows(upper) + rows(lower);
}
std::string lednicer() { return "My section\n 31. 31.\n\n" + rows(side(true)) + "\n" + rows(side(false)); }
SectionShape shape(const std::string& text) { return read_section_file(TextFile::parse(text, "my.dat")); }

TEST(SectionShape, SeligAndLednicerFilesOfOneSectionGiveTheSamePointsAndItsThicknessOf12AndCamberOf2Percent) {
  const SectionShape a = shape(selig()), b = shape(lednicer());
  EXPECT_EQ(a.label, "My section");
  ASSERT_EQ(a.x.size(), b.x.size());
  for (std::size_t i = 0; i < a.x.size(); ++i) {
    EXPECT_DOUBLE_EQ(a.x[i], b.x[i]);
    EXPECT_DOUBLE_EQ(a.y[i], b.y[i]);
  }
  EXPECT_NEAR(a.thickness_percent, 12.0, 0.2);
  EXPECT_NEAR(a.camber_percent, 2.0, 0.1);
}

TEST(SectionShape, ALoopThatBeginsBelowIsTurnedRound) {
  auto upper = side(true), lower = side(false);
  std::reverse(lower.begin(), lower.end());
  upper.erase(upper.begin());
  EXPECT_NEAR(shape("x\n" + rows(lower) + rows(upper)).camber_percent, 2.0, 0.1);
}

TEST(SectionShape, MistakesInAFileAreNamedWithLineAndValueAndWhatToDo) {
  using fixtures::replaced;
  EXPECT_THAT(message([] { shape(replaced(lednicer(), " 31. 31.", " 31. 35.")); }),
              AllOf(HasSubstr("my.dat:2"), HasSubstr("31 and 35 points announced, 62 lines follow"), HasSubstr("correct the counts")));
  EXPECT_THAT(message([] { shape("a\n0.5 zero\n" + rows(side(true))); }), AllOf(HasSubstr("my.dat:2"), HasSubstr("zero")));
  EXPECT_THAT(message([] { shape("a\n0.5 0.9\n" + rows(side(true))); }), AllOf(HasSubstr("my.dat:2"), HasSubstr("0.9"), HasSubstr("-0.5")));
  EXPECT_THAT(message([] { shape("a\n1 0\n0.5 0.1 7\n" + rows(side(true))); }),
              AllOf(HasSubstr("my.dat:3"), HasSubstr("3 fields, expected 2")));
  EXPECT_THAT(message([] { shape("a\n1 0\n0 0\n1 0\n"); }), HasSubstr("3 lines below the name, expected 10 to 600"));
  EXPECT_THAT(message([] { shape("a\n" + rows(side(true)) + rows(side(false))); }),
              HasSubstr("the last point is 1.00 chords from the first, expected at most 0.1"));
}

TEST(SectionShape, DigitsAreTakenInAnySpellingAndThoseThatNameNoSectionAreRefused) {
  for (const char* text : {"4412", "NACA 4412", "naca4412", "naca-4412"}) EXPECT_EQ(naca_digits(text), "4412") << text;
  EXPECT_EQ(naca_digits("NACA 23012"), "23012");
  EXPECT_FALSE(naca_digits("clark_y"));
  EXPECT_FALSE(naca_digits("naca44"));
  EXPECT_THAT(message([] { naca_digits("4401"); }), HasSubstr("thickness of 1 %, expected 2 to 40"));
  EXPECT_THAT(message([] { naca_digits("4012"); }), HasSubstr("camber"));
  EXPECT_THAT(message([] { naca_digits("63412"); }), HasSubstr("210, 220"));
}

// A thin section with a kink of lift at 15 degrees.
XfoilPoints thin_section(int from_mdeg, int to_mdeg) {
  XfoilPoints p;
  for (int a = from_mdeg; a <= to_mdeg; a += 500) p[a] = {0.1 * 1e-3 * std::min(a, 15000), 0.01 + 1e-10 * a * a};
  return p;
}

TEST(SectionSweeps, TheBranchEndsAtAHoleWiderThan2DegreesAndWhereLiftJumpsAndASmallerHoleIsFilled) {
  XfoilPoints p = thin_section(-8000, 18000);
  for (const int hole : {3000, 3500, 10000, 10500, 11000, 11500}) p.erase(hole);
  for (auto& [a, c] : p)
    if (a <= -5000) c.cl -= 0.3;  // another solution
  const SectionPolar branch = branch_around_zero(p);
  EXPECT_DOUBLE_EQ(branch.alpha_deg.front(), -4.5);
  EXPECT_DOUBLE_EQ(branch.alpha_deg.back(), 9.5);
  EXPECT_EQ(branch.alpha_deg.size(), 29u);
  EXPECT_NEAR(branch.cl[15], 0.3, 1e-12) << "3 degrees, from a straight line";
}

TEST(SectionSweeps, ASweepThatHangsOrDivergesCostsItsReynoldsNumberAtMostAndIsSaid) {
  SweepSettings s;
  s.reynolds = {30e3, 60e3, 100e3, 200e3};
  std::vector<std::string> said;
  const SectionResult r = polars_of_sweeps(
      "my", "6.99", s,
      [](const XfoilSweep& sweep) {
        const bool up = sweep.last_deg > 0;
        if (sweep.reynolds == 30e3) return XfoilProgram::Result{};                             // diverged at once
        if (sweep.reynolds == 60e3) return XfoilProgram::Result{thin_section(0, 3000), true};  // hung early
        if (sweep.reynolds == 100e3) return XfoilProgram::Result{up ? thin_section(0, 16000) : thin_section(-9000, 0), up};  // hung late
        return XfoilProgram::Result{up ? thin_section(0, 20000) : thin_section(-12000, 0), false};
      },
      [&](const std::string& line) { said.push_back(line); });
  ASSERT_EQ(r.polar.tables.size(), 2u);
  EXPECT_EQ(r.polar.tables[0].reynolds, 100e3);
  EXPECT_TRUE(r.hung);
  EXPECT_EQ(said.size(), 4u);
  const std::string remarks = ::testing::PrintToString(r.remarks);
  EXPECT_THAT(remarks,
              AllOf(HasSubstr("Re 30000 is left out: nothing converged"), HasSubstr("Re 60000: a sweep ended at its time limit, 40 s"),
                    HasSubstr("Re 60000 is left out"), HasSubstr("Re 100000: a sweep ended")));
  // Over the full circle, and as a plant reads it.
  const sim::Polar read = sim::parse_polar(polar_file_text(r.polar), "written.toml");
  EXPECT_NEAR(sim::polar_at(read, 5.0, 150e3).cl, 0.5, 1e-3);
  EXPECT_NEAR(sim::polar_at(read, 90.0, 150e3).cd, 1.2, 0.05);
  s.reynolds = {30e3};
  EXPECT_THAT(message([&] { polars_of_sweeps("my", "6.99", s, [](const XfoilSweep&) { return XfoilProgram::Result{}; }, {}); }),
              HasSubstr("XFOIL converges at no Reynolds number"));
}

TEST(SectionSweeps, PolarsOfOtherReynoldsNumbersBlendOnTheGridOfTheFirstAndAreRefusedAsTheyAre) {
  const auto polars = [](std::vector<double> reynolds, double lift) {
    SweepSettings s;
    s.reynolds = std::move(reynolds);
    return polars_of_sweeps("my", "6.99", s,
                            [&](const XfoilSweep& sweep) {
                              XfoilPoints p = thin_section(-12000, 20000);
                              for (auto& [a, c] : p) c.cl *= lift * (1.0 + 1e-6 * sweep.reynolds);
                              return XfoilProgram::Result{p, false};
                            },
                            {})
        .polar;
  };
  const sim::Polar a = polars({50e3, 100e3}, 1.0), b = polars({40e3, 60e3, 120e3}, 0.5);
  EXPECT_THAT(message([&] { blend(a, b, 0.5); }), HasSubstr("differ"));
  const sim::Polar c = blend(a, on_grid_of(a, b), 0.5);
  EXPECT_NEAR(sim::polar_at(c, 4.0, 50e3).cl, 0.75 * 0.4 * 1.05, 1e-9);
  EXPECT_NEAR(sim::polar_at(c, 4.0, 100e3).cl, 0.75 * 0.4 * 1.10, 1e-9);
}

TEST(PolarCache, WhatIsKeptIsUsedForItsOwnKeyAloneAndACutOffFileIsNot) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / ("rotorloop_polars" + std::to_string(::getpid()));
  SweepSettings s;
  s.reynolds = {100e3};
  const std::string text = polar_file_text(polars_of_sweeps("my", "6.99", s,
                                                            [](const XfoilSweep&) {
                                                              return XfoilProgram::Result{thin_section(-12000, 20000), false};
                                                            },
                                                            {})
                                               .polar);
  const auto file = keep_polar(folder, "one\n0.1 0.2\n", text);
  ASSERT_FALSE(file.empty());
  ASSERT_TRUE(cached_polar(folder, "one\n0.1 0.2\n"));
  EXPECT_EQ(polar_file_text(*cached_polar(folder, "one\n0.1 0.2\n")), text);
  EXPECT_FALSE(cached_polar(folder, "one\n0.1 0.3\n"));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_FALSE(cached_polar(folder, "one\n0.1 0.2\n"));
  EXPECT_TRUE(keep_polar("/proc/nowhere", "one", text).empty()) << "no place to write is no error";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace rotorloop::propeller
