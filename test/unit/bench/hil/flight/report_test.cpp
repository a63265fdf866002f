// Plots and the report page: what is drawn is what was measured, and the page needs nothing but itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "bench/hil/flight/run_report.hpp"
#include "bench/render/svg_plot.hpp"
#include "host/base/text_file.hpp"
#include "test/unit/bench/hil/flight/synthetic_run.hpp"
#include "test/unit/bench/markup.hpp"
#include "test/unit/bench/temp_folder.hpp"

namespace rotorloop::hil {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(PlotMarkers, EverySampleIsADotOrARingAndNothingJoinsThem) {
  render::Plot p;
  p.series = {{.label = "held out", .x = {0, 1, 2}, .y = {1, 2, 1}, .marker = render::Marker::dot},
              {.label = "fitted", .x = {0, 1, std::nan("")}, .y = {2, 1, 1}, .marker = render::Marker::ring}};
  const std::string svg = render::plot_svg(p);
  EXPECT_EQ(test::count(svg, "h0"), 3u + 1u);  // and one in the legend
  EXPECT_EQ(test::count(svg, "a2.4 2.4"), 2u * (2u + 1u));
  EXPECT_THAT(svg, Not(HasSubstr("stroke-width=\"1.5\"")));
}

TEST(NiceTicks, StandAtMultiplesOfOneTwoOrFive) {
  const auto t = render::nice_ticks(0, 10, 5);
  EXPECT_THAT(t.at, ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_EQ(t.decimals, 0);
  const auto fine = render::nice_ticks(0.013, 0.027, 5);
  EXPECT_EQ(fine.decimals, 3);
  EXPECT_THAT(fine.at,
              ElementsAre(::testing::DoubleNear(0.015, 1e-12), ::testing::DoubleNear(0.020, 1e-12), ::testing::DoubleNear(0.025, 1e-12)));
}
TEST(NiceTicks, NeverMoreThanTwiceTheNumberWantedAndAlwaysInside) {
  const RandomStream random(3, 3);
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const double low = random.gaussian(i) * std::pow(10, static_cast<double>(random.bits(i) % 9) - 4.0);
    const double high = low + (1e-3 + random.uniform(i + 9999)) * std::pow(10, static_cast<double>(random.bits(i + 77) % 9) - 4.0);
    const auto t = render::nice_ticks(low, high, 6);
    EXPECT_LE(t.at.size(), 13u);
    EXPECT_GE(t.at.size(), 2u) << low << " " << high;
    const double slack = 1e-8 * (high - low) + 1e-12 * std::fabs(low);
    for (const double v : t.at) {
      EXPECT_GE(v, low - slack);
      EXPECT_LE(v, high + slack);
    }
  }
}

TEST(DecadeTicks, StandAtPowersOfTenWithTwosAndFivesWhereThereIsRoom) {
  const auto texts = [](const render::Ticks& t) {
    std::vector<std::string> out;
    for (const double at : t.at) out.push_back(render::tick_text(at, t));
    return out;
  };
  EXPECT_THAT(texts(render::decade_ticks(-2.0, std::log10(2.0), 10)), ElementsAre("0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1", "2"));
  EXPECT_THAT(texts(render::decade_ticks(-3.1, 1.2, 5)), ElementsAre("0.001", "0.01", "0.1", "1", "10"));
  EXPECT_THAT(texts(render::decade_ticks(-9.0, -3.0, 3)), ElementsAre("10⁻⁸", "10⁻⁶", "0.0001"));
}

TEST(Plot, OfPowersOnLogarithmicAxesIsAStraightLineAndLeavesOutWhatIsNotAboveZero) {
  render::Plot p;
  p.log_x = p.log_y = true;
  p.series = {{.label = "", .x = {0.01, 0.1, 1.0, 10.0}, .y = {1e-4, 1e-2, 1.0, 0.0}}};
  const std::string svg = render::plot_svg(p);
  const auto d = svg.find("<path class=\"ln c0\"");
  ASSERT_NE(d, std::string::npos);
  double x[3], y[3];
  ASSERT_EQ(std::sscanf(svg.c_str() + svg.find(" d=\"M", d), " d=\"M%lf %lfL%lf %lfL%lf %lf\"", &x[0], &y[0], &x[1], &y[1], &x[2], &y[2]),
            6);
  EXPECT_NEAR(x[1] - x[0], x[2] - x[1], 0.2);
  EXPECT_NEAR(y[1] - y[0], y[2] - y[1], 0.2);
  EXPECT_THAT(svg, AllOf(HasSubstr(">0.01<"), HasSubstr(">0.0001<"), Not(HasSubstr("nan"))));
}

TEST(Decimation, KeepsEveryPeakOfAMinuteAtOneKilohertz) {
  std::vector<double> x(60'000), y(60'000), xs, ys;
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = static_cast<double>(i) * 1e-3;
    y[i] = std::sin(x[i]);
  }
  y[31'415] = 7;  // one sample wide
  y[40'000] = -9;
  render::decimate_min_max(x, y, 0, 60, 700, xs, ys);
  EXPECT_LE(xs.size(), 4u * 701u);
  EXPECT_EQ(*std::max_element(ys.begin(), ys.end()), 7);
  EXPECT_EQ(*std::min_element(ys.begin(), ys.end()), -9);
  EXPECT_TRUE(std::is_sorted(xs.begin(), xs.end()));
  EXPECT_EQ(xs.front(), x.front());
  EXPECT_EQ(xs.back(), x.back());
}
TEST(Decimation, KeepsGaps) {
  std::vector<double> xs, ys;
  render::decimate_min_max({0, 1, 2, 3}, {5, std::nan(""), std::nan(""), 6}, 0, 3, 100, xs, ys);
  ASSERT_EQ(ys.size(), 3u);
  EXPECT_TRUE(std::isnan(ys[1]));
}

TEST(Plot, IsBalancedSvgWhoseLineRunsBetweenTheAxes) {
  render::Plot p;
  p.title = "a <b> & \"c\"";
  p.x_label = "time, s";
  p.y_label = "error, cm";
  p.series.push_back({.label = "one", .x = {0, 1, 2}, .y = {0, 10, 5}});
  const auto svg = render::plot_svg(p);
  EXPECT_EQ(test::unbalanced(svg), "");
  EXPECT_THAT(svg, AllOf(HasSubstr("a &lt;b&gt; &amp; &quot;c&quot;"), HasSubstr(">time, s<"), HasSubstr(">error, cm<"), HasSubstr(">one<"),
                         Not(HasSubstr("nan"))));
  // The highest sample is drawn above the two others (SVG's y runs down).
  const auto d = svg.substr(svg.rfind(" d=\"M") + 5);
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0;
  ASSERT_EQ(std::sscanf(d.c_str(), "%lf %lfL%lf %lfL%lf %lf", &x0, &y0, &x1, &y1, &x2, &y2), 6) << d;
  EXPECT_LT(x0, x1);
  EXPECT_NEAR(x1 - x0, x2 - x1, 0.2);
  EXPECT_NEAR((y2 - y1) * 2, y0 - y1, 0.3);
}
TEST(Plot, OfNothingOrOfOneValueIsStillAPlot) {
  EXPECT_EQ(test::unbalanced(render::plot_svg({})), "");
  render::Plot p;
  p.series.push_back({.label = "flat", .x = {1, 1}, .y = {0, 0}});
  EXPECT_THAT(render::plot_svg(p), AllOf(Not(HasSubstr("nan")), Not(HasSubstr("inf"))));
  p.series.push_back({.label = "missing", .x = {0, 1}, .y = {std::nan(""), std::nan("")}});
  EXPECT_THAT(render::plot_svg(p), Not(HasSubstr("nan")));
}
TEST(Plot, EqualAxesDrawACircleRound) {
  render::Plot p;
  p.equal_axes = true;
  p.width_px = 340;
  p.height_px = 320;
  render::Series s;
  for (int i = 0; i <= 360; ++i) {
    s.x.push_back(3 * std::cos(i * 0.0174532925));
    s.y.push_back(3 * std::sin(i * 0.0174532925));
  }
  p.series.push_back(s);
  const auto svg = render::plot_svg(p);
  double x_low = 1e9, x_high = -1e9, y_low = 1e9, y_high = -1e9;
  const auto start = svg.rfind(" d=\"M") + 4;
  std::string d = svg.substr(start, svg.find('"', start) - start);
  std::replace_if(
      d.begin(), d.end(), [](char c) { return c == 'M' || c == 'L'; }, ' ');
  std::istringstream in(d);
  for (double x, y; in >> x >> y;) {
    x_low = std::min(x_low, x);
    x_high = std::max(x_high, x);
    y_low = std::min(y_low, y);
    y_high = std::max(y_high, y);
  }
  EXPECT_NEAR(x_high - x_low, y_high - y_low, 1.0);
  EXPECT_GT(x_high - x_low, 100);
}
TEST(Plot, ColouredBandsAreNamedOnceInTheLegendAndGreyOnesWhereTheyStand) {
  render::Plot p;
  p.series.push_back({.label = "", .x = {0, 10}, .y = {1, 2}});
  p.bands = {{0, 2, "vortex ring", 0}, {2, 5, "windmill", 4}, {5, 6, "vortex ring", 0}, {7, 9, "counted"}};
  const auto svg = render::plot_svg(p);
  EXPECT_EQ(test::unbalanced(svg), "");
  EXPECT_EQ(test::count(svg, ">vortex ring<"), 1u);
  EXPECT_EQ(test::count(svg, "\"bd g0\""), 3u) << "two bands and the swatch of the legend";
  EXPECT_EQ(test::count(svg, "\"bd g4\""), 2u);
  EXPECT_EQ(test::count(svg, "<rect class=\"bd\""), 1u);
  EXPECT_EQ(test::count(svg, ">counted<"), 1u);
}
TEST(Plot, SixtySecondsAtOneKilohertzStayBelowSixtyKilobytes) {
  render::Plot p;
  render::Series s;
  const RandomStream random(5, 5);
  for (int i = 0; i < 60'000; ++i) {
    s.x.push_back(i * 1e-3);
    s.y.push_back(random.gaussian(static_cast<std::uint64_t>(i)));
  }
  p.series.push_back(s);
  EXPECT_LT(render::plot_svg(p).size(), 60'000u);
}
TEST(BarChart, LongerBarForTheLargerValueAndAMarkForThePublishedOne) {
  render::BarChart c;
  c.reference_label = "published";
  c.bars = {{.label = "a", .value = 10, .spread = 1.0, .points = {9, 11}, .reference = 10.5, .colour = 0},
            {.label = "b", .value = 5, .spread = {}, .points = {}, .reference = {}, .colour = 1},
            {.label = "c", .value = std::nan(""), .spread = {}, .points = {}, .reference = {}, .colour = 2}};
  const auto svg = render::bar_chart_svg(c);
  EXPECT_EQ(test::unbalanced(svg), "");
  const auto width = [&](const char* css) { return std::strtod(svg.c_str() + svg.find("width=\"", svg.find(css)) + 7, nullptr); };
  EXPECT_NEAR(width("\"f0\""), 2 * width("\"f1\""), 0.3);
  EXPECT_THAT(svg, AllOf(HasSubstr(">published<"), HasSubstr("not measured"), Not(HasSubstr("nan"))));
}
TEST(Timeline, IntervalsCloserThanCanBeSeenAreDrawnAsOne) {
  render::Timeline t;
  t.x_max = 60;
  render::TimelineRow row{.label = "ESC 1: voltage", .intervals = {}, .colour = 0};
  for (int i = 0; i < 30'000; ++i) row.intervals.push_back({i * 0.002, i * 0.002 + 0.001});
  t.rows.push_back(row);
  const auto svg = render::timeline_svg(t);
  EXPECT_EQ(test::unbalanced(svg), "");
  EXPECT_LT(svg.size(), 5000u);
}

TEST(LimiterNames, RoundTripThroughTheLogHeader) {
  const auto names = numbered_names(esc_limiter_codes());
  EXPECT_EQ(names.at(0), "none");
  EXPECT_EQ(names.at(static_cast<int>(firmware::Limiter::voltage)), "voltage");
  EXPECT_EQ(numbered_names("1 tilt, 2 thrust,x, 4").size(), 2u);
}

TEST(LimiterNames, AreTheTableOfWireMdRowByRowAndNoRowMore) {
  std::ifstream file(std::string(ROTORLOOP_SOURCE_DIR) + "/docs/wire.md");
  std::map<int, std::string> documented;
  bool in_table = false;
  for (std::string line; std::getline(file, line);) {
    in_table = line.starts_with("| limiter code |") || (in_table && line.starts_with("|"));
    int code = 0;
    char name[32] = {};
    if (in_table && std::sscanf(line.c_str(), "| %d | `%31[a-z_]` |", &code, name) == 2) documented[code] = name;
  }
  EXPECT_EQ(documented, numbered_names(esc_limiter_codes()));
}

class Report : public ::testing::Test {
 protected:
  Report() {
    run_.flight_s = 5.0;
    run_.make(folder_.path());
  }
  test::TempFolder folder_;
  SyntheticRun run_;
};

TEST_F(Report, PageIsBalancedAndNeedsNothingButItself) {
  const auto html = test::read_text(write_hil_report(run_.folder));
  EXPECT_EQ(test::unbalanced(html), "");
  for (const auto* part : {"http:", "https:", "<script", "<link", "@import", "url(", "src=", ">nan<", "nan ", folder_.path().c_str()})
    EXPECT_THAT(html, Not(HasSubstr(part)));
  EXPECT_LT(html.size(), 2'000'000u);
}
TEST_F(Report, ShowsVerdictTableLimitsEveryFlightAndTheInputs) {
  const auto html = test::read_text(write_hil_report(run_.folder));
  EXPECT_THAT(html, AllOf(HasSubstr("class=\"verdict fail\""), HasSubstr("30 of 30 flights completed, 4 of 5 limits met."),
                          HasSubstr("<li>limit missed: mean_tracking_error vertical pd_ff_thrust_drag z: "),
                          HasSubstr("Next: look at errors over time"), HasSubstr("PD FF + THR + DRG")));
  EXPECT_THAT(html, AllOf(HasSubstr("id=\"flight-horizontal\""), HasSubstr("id=\"flight-vertical\""), HasSubstr("paper, Fig. 9"),
                          HasSubstr("ESC 2: voltage"), HasSubstr("controller: thrust")));
  EXPECT_THAT(html, HasSubstr("&lt;this&gt; is how a warning looks &amp; reads"));
  EXPECT_THAT(html, HasSubstr("--seeds 1,2,3,4,5 --variants pd_ff,pd_ff_drag,pd_ff_thrust_drag"));
  EXPECT_EQ(test::count(html, "<td class=\"l hash\">"), 6u) << "one line for each input";
}
TEST_F(Report, PlotsTheErrorThatTheTableStates) {
  const auto r = read_hil_report(run_.folder);
  ASSERT_EQ(r.flights.size(), 2u);
  for (const auto& t : r.flights[0].traces) {
    double sum = 0;
    int n = 0;
    for (std::size_t i = 0; i < t.t_s.size(); ++i)
      if (t.t_s[i] >= r.flights[0].first_motion_s && t.t_s[i] <= r.flights[0].last_motion_s) {
        sum += t.error_cm[i];
        ++n;
      }
    const auto row =
        std::find_if(r.table.begin(), r.table.end(), [&](const auto& x) { return x.flight == "horizontal" && x.variant == t.variant; });
    ASSERT_NE(row, r.table.end());
    EXPECT_NEAR(sum / n, row->seeds.front(), 1e-3) << t.variant;  // rounding of the log: 10 µm
  }
}
TEST_F(Report, WorksOutTheWorstBusLoadFromTheRecordedFrames) {
  const auto r = read_hil_report(run_.folder);
  ASSERT_FALSE(r.flights[0].buses.empty());
  const auto& bus = r.flights[0].buses[0];
  // Five frames of 8 bytes and 135 worst-case bits, a thousand times a second: 67.5 %.
  EXPECT_THAT(bus.formula.back(), HasSubstr("67.5"));
  EXPECT_EQ(bus.limit_percent, 70);
  EXPECT_GT(bus.load_percent.size(), 450u);
  EXPECT_LT(*std::max_element(bus.load_percent.begin(), bus.load_percent.end()), 67.5) << "real stuffing is below the worst case";
}
TEST_F(Report, OfLogsThatWereDeletedStillStatesTheFigures) {
  std::filesystem::remove_all(run_.folder / "horizontal");
  const auto r = read_hil_report(run_.folder);
  EXPECT_TRUE(r.flights[0].traces.empty());
  EXPECT_EQ(r.table.size(), 6u);
  EXPECT_EQ(test::unbalanced(hil_report_html(r)), "");
}
TEST_F(Report, OfADamagedLogNamesFileAndLine) {
  const auto log = run_.folder / "horizontal/pd_ff/1/flight.csv";
  const auto text = test::read_text(log);
  write_text_file(log, text.substr(0, text.size() - 200));
  EXPECT_THAT(test::error_of([&] { read_hil_report(run_.folder); }, ExitCode::data_quality),
              AllOf(HasSubstr("flight.csv:"), HasSubstr("cells, the header has")));
}

}  // namespace
}  // namespace rotorloop::hil
