// Maps of a disk: every cell stands where it belongs and has the colour of its value, and the bar says what colours mean.
#include "bench/render/disk_map.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <regex>
#include <sstream>

#include "host/base/random.hpp"
#include "test/unit/bench/markup.hpp"

namespace rotorloop::render {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kShades = 96;
constexpr double kCentre_px = 46 + (500 - 96 - 2 * 46) / 2.0;  // of a map 500 px wide, in x and y

std::string colour(double share) {
  const Rgb c = field_colour(share);
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", c.r, c.g, c.b);
  return text;
}
const std::string kLowest = colour(0.5 / kShades), kHighest = colour(1 - 0.5 / kShades);

struct Point {
  double x, y;
};
// Colour of each group of cells -> middle of its corners relative to the disk's centre, x to the right and y upwards.
std::map<std::string, Point> cells_of(const std::string& svg) {
  std::map<std::string, Point> out;
  const std::regex path("<path fill=\"(#[0-9a-f]{6})\" stroke=\"[^\"]*\" stroke-width=\"[^\"]*\" d=\"([^\"]*)\"");
  const std::regex command("([Mla])([^Mlaz]*)");
  for (std::sregex_iterator it(svg.begin(), svg.end(), path), end; it != end; ++it) {
    const std::string d = (*it)[2];
    Point at{0, 0}, sum{0, 0};
    int corners = 0;
    for (std::sregex_iterator c(d.begin(), d.end(), command), last; c != last; ++c, ++corners) {
      std::istringstream numbers((*c)[2]);
      double skipped = 0, x = 0, y = 0;
      if ((*c)[1] == "a")
        for (int k = 0; k < 5; ++k) numbers >> skipped;
      numbers >> x >> y;
      at = (*c)[1] == "M" ? Point{x, y} : Point{at.x + x, at.y + y};
      sum = {sum.x + at.x - kCentre_px, sum.y - (at.y - kCentre_px)};
    }
    out[(*it)[1]] = {sum.x / corners, sum.y / corners};
  }
  return out;
}

DiskMap ring_of(std::vector<double> values) {
  DiskMap m;
  m.label = "load, N/m²";
  m.ring_edges_m = {0.01, 0.06};
  m.sectors = static_cast<int>(values.size());
  m.values = std::move(values);
  return m;
}

TEST(DiskMap, ShowsForwardUpAndLeftOnTheLeft) {
  // Eight sectors; the first lies between x (forward) and y (left), the fifth opposite.
  const auto cells = cells_of(disk_map_svg(ring_of({9, 5, 5, 5, 1, 5, 5, 5})));
  ASSERT_TRUE(cells.contains(kHighest) && cells.contains(kLowest));
  EXPECT_LT(cells.at(kHighest).x, -10) << "22.5 degrees to the left of forward";
  EXPECT_GT(cells.at(kHighest).y, 2 * -cells.at(kHighest).x - 1);
  EXPECT_GT(cells.at(kLowest).x, 10);
  EXPECT_LT(cells.at(kLowest).y, -2 * cells.at(kLowest).x + 1);
}
TEST(DiskMap, HighestCellHasTheTopColourLowestTheBottomColour) {
  const auto svg = disk_map_svg(ring_of({-3, 0, 7, 2}));
  EXPECT_EQ(test::unbalanced(svg), "");
  const auto cells = cells_of(svg);
  EXPECT_EQ(cells.size(), 4u);
  EXPECT_TRUE(cells.contains(kLowest));
  EXPECT_TRUE(cells.contains(kHighest));
  EXPECT_TRUE(cells.contains(colour((std::floor(kShades * 0.3) + 0.5) / kShades))) << "0 is three tenths from -3 to 7";
}
TEST(DiskMap, ValuesBeyondTheScaleHaveItsEndsColourAndAnArrowOnTheBar) {
  DiskMap m = ring_of({-180, 0, 10, 20, 5, 15});
  const auto arrows = [&] { return test::count(disk_map_svg(m), "h16L"); };
  EXPECT_EQ(arrows(), 0u);
  m.low = -10;
  EXPECT_EQ(arrows(), 1u);
  m.high = 15;
  EXPECT_EQ(arrows(), 2u);
  const auto svg = disk_map_svg(m);
  EXPECT_TRUE(cells_of(svg).contains(kLowest));
  EXPECT_THAT(svg, AllOf(HasSubstr(">−10<"), HasSubstr(">15<"), Not(HasSubstr("180"))));
}
TEST(DiskMap, BarCarriesTicksAtRoundValuesWithinItsRangeAndTheUnit) {
  const auto svg = disk_map_svg(ring_of({-0.013, 0.002, 0.01, 0.021}));
  EXPECT_THAT(svg, AllOf(HasSubstr(">−0.01<"), HasSubstr(">0.00<"), HasSubstr(">0.02<"), HasSubstr(">load, N/m²<")));
  EXPECT_THAT(svg, AllOf(Not(HasSubstr(">−0.02<")), Not(HasSubstr(">0.03<"))));
}
TEST(DiskMap, ACellWithoutAValueIsLeftEmpty) { EXPECT_EQ(cells_of(disk_map_svg(ring_of({1, 2, std::nan(""), 3}))).size(), 3u); }
TEST(DiskMap, OfNothingOrOfOneValueIsStillAPicture) {
  EXPECT_EQ(test::unbalanced(disk_map_svg({})), "");
  const auto flat = disk_map_svg(ring_of({4, 4, 4, 4}));
  EXPECT_EQ(test::unbalanced(flat), "");
  EXPECT_THAT(flat, AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
  DiskMap wrong = ring_of({1, 2, 3, 4});
  wrong.values.pop_back();
  EXPECT_THAT(disk_map_svg(wrong), HasSubstr("nothing to draw"));
}
TEST(DiskMap, MarksWhereTheFieldChangesItsSign) {
  EXPECT_EQ(test::count(disk_map_svg(ring_of({1, 2, 3, 4})), "class=\"zr\""), 0u);
  EXPECT_EQ(test::count(disk_map_svg(ring_of({1, -2, 3, 4})), "class=\"zr\""), 1u);
}
TEST(DiskMap, WindArrowsStandUpstreamAndPointAtTheDisk) {
  DiskMap m = ring_of({1, 2, 3, 4});
  m.spin = 0;
  EXPECT_EQ(test::count(disk_map_svg(m), "class=\"wd\""), 0u);
  m.wind_label = "8.5 m/s";
  for (const double from_deg : {0.0, 90.0, 180.0, 270.0}) {
    m.wind_from_rad = from_deg * std::numbers::pi / 180;
    const auto svg = disk_map_svg(m);
    EXPECT_THAT(svg, HasSubstr(">wind 8.5 m/s<"));
    const auto at = svg.find("class=\"wd\" d=\"M");
    double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    ASSERT_EQ(std::sscanf(svg.c_str() + at + 15, "%lf %lfL%lf %lf", &x0, &y0, &x1, &y1), 4) << svg.substr(at, 60);
    const double up = std::cos(*m.wind_from_rad), left = std::sin(*m.wind_from_rad);
    EXPECT_GT(up * (kCentre_px - y1) + left * (kCentre_px - x1), 150) << "outside the disk, on the side that the wind comes from";
    EXPECT_LT(up * (y0 - y1) + left * (x0 - x1), -15) << "and towards it";
  }
}
TEST(DiskMap, RotationArrowTurnsAsTheSpinSays) {
  DiskMap m = ring_of({1, 2, 3, 4});
  // The arc is at the rear left: counter-clockwise it runs down, clockwise up.
  const auto rise_px = [&] {
    const auto svg = disk_map_svg(m);
    double x0 = 0, y0 = 0, r = 0, x1 = 0, y1 = 0;
    int large = 0, sweep = 0;
    const auto at = svg.find("class=\"wd\" d=\"M") + 15;
    EXPECT_EQ(std::sscanf(svg.c_str() + at, "%lf %lfA%lf %lf 0 %d %d %lf %lf", &x0, &y0, &r, &r, &large, &sweep, &x1, &y1), 8);
    EXPECT_EQ(sweep, m.spin > 0 ? 0 : 1) << "SVG's sweep flag: 1 is clockwise";
    return y0 - y1;
  };
  m.spin = 1;
  EXPECT_LT(rise_px(), -50);
  m.spin = -1;
  EXPECT_GT(rise_px(), 50);
}
TEST(DiskMap, FourMapsOf64RingsAnd96SectorsOfNoiseStayBelowTwoMegabytes) {
  DiskMap m;
  m.sectors = 96;
  for (int i = 0; i <= 64; ++i) m.ring_edges_m.push_back(0.006 + 0.0009 * i);
  const RandomStream random(7, 7);
  for (std::uint64_t i = 0; i < 64 * 96; ++i) m.values.push_back(random.gaussian(i));
  const auto svg = disk_map_svg(m);
  EXPECT_LT(4 * svg.size(), 2'000'000u);
  EXPECT_EQ(test::unbalanced(svg), "");
}

// Lightness L* of CIE 1976 under D65.
double lightness(Rgb c) {
  const auto linear = [](double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); };
  const double y = 0.2126 * linear(c.r / 255.0) + 0.7152 * linear(c.g / 255.0) + 0.0722 * linear(c.b / 255.0);
  return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
}
TEST(FieldColour, LightnessRisesInEvenSteps) {
  constexpr int kSteps = 12;
  const double whole = lightness(field_colour(1)) - lightness(field_colour(0));
  EXPECT_GT(whole, 70);
  for (int i = 0; i < kSteps; ++i) {
    const double step = lightness(field_colour((i + 1.0) / kSteps)) - lightness(field_colour(static_cast<double>(i) / kSteps));
    EXPECT_NEAR(step, whole / kSteps, 0.3 * whole / kSteps) << i;
  }
}
TEST(FieldColour, BeyondTheEndsStaysAtTheEnds) {
  EXPECT_EQ(colour(-3), colour(0));
  EXPECT_EQ(colour(7), colour(1));
}

}  // namespace
}  // namespace rotorloop::render
