// The protocol of the validation, on rows that the solve itself made.
#include "bench/propeller/validation.hpp"

#include <cmath>

#include "bench/propeller/full_circle.hpp"
#include "bench/propeller/report/validation_output.hpp"
#include "test/unit/bench/propeller/fixtures.hpp"

namespace rotorloop::propeller {
namespace {
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kDiameter_m = 0.127;

// A cambered section of our own making: lift 0.1 per degree from -4 degrees, stall at 12.
sim::Polar cambered() {
  std::vector<SectionPolar> polars;
  for (const double reynolds : {20e3, 40e3}) {
    SectionPolar p{"made up", reynolds, 9.0, {}, {}, {}};
    for (double a = -12.0; a <= 15.0; a += 0.5) {
      p.alpha_deg.push_back(a);
      p.cl.push_back(0.1 * (std::min(a, 12.0 - 0.5 * std::max(0.0, a - 12.0)) + 4.0));
      p.cd.push_back((reynolds < 30e3 ? 0.035 : 0.028) + 0.0006 * (a - 2.0) * (a - 2.0));
    }
    polars.push_back(std::move(p));
  }
  return full_circle(std::move(polars));
}
sim::Blade blade() {
  const PropellerGeometry g = read_uiuc_geometry(TextFile::parse(fixtures::kGeometry, "geom.txt"), 0.5 * kDiameter_m, 2);
  sim::Blade b;
  b.radius_m = g.radius_m;
  b.hub_radius_m = g.hub_radius_m;
  for (const auto& s : g.stations) b.stations.push_back({s.r_m, s.chord_m, s.twist_deg, "made up"});
  b.polars.emplace("made up", cambered());
  return b;
}
MeasuredRow solved(const sim::Rotor& rotor, double rpm, double j) {
  const Coefficients c = predict(rotor, kDiameter_m, {rpm, j, 0.0, 0.0});
  return {rpm, j, c.ct, c.cp};
}
MeasuredSet static_set(const sim::Rotor& rotor) {
  MeasuredSet s{"static", {}, true};
  for (double rpm = 2000; rpm <= 8000; rpm += 1000) s.rows.push_back(solved(rotor, rpm, 0.0));
  return s;
}
MeasuredSet sweep(const sim::Rotor& rotor, double rpm, double to_j) {
  MeasuredSet s{"J " + std::to_string(static_cast<int>(rpm)) + " rpm", {}};
  for (double j = 0.1; j <= to_j; j += 0.1) s.rows.push_back(solved(rotor, rpm, j));
  return s;
}

TEST(Predict, ThrustAndPowerAreMadeDimensionlessWithRevolutionsPerSecondAndDiameter) {
  const sim::Rotor rotor(blade());
  const Coefficients hover = predict(rotor, kDiameter_m, {6000.0, 0.0, 0.0, 0.0});
  // Momentum theory: power at least T^1.5 / sqrt(2 rho A), which is C_P >= C_T^1.5 sqrt(2 / pi); figure of merit 0.4 to 0.8.
  const double ideal = std::pow(hover.ct, 1.5) * std::sqrt(2.0 / 3.14159265358979);
  EXPECT_GT(ideal / hover.cp, 0.4);
  EXPECT_LT(ideal / hover.cp, 0.8);
  EXPECT_GT(hover.ct, predict(rotor, kDiameter_m, {6000.0, 0.5, 0.0, 0.0}).ct);
}

// Row k of a fitted set is used for the fit when k is odd, counted from 1; a set that is not fitted is held out whole.
TEST(Protocol, EverySecondRowOfAFittedSetIsHeldOutAndAllOfOthers) {
  MeasuredSet s{"x", {{1, 0, .1, .1}, {2, 0, .1, .1}, {3, 0, .1, .1}, {4, 0, .1, .1}, {5, 0, .1, .1}}, true};
  EXPECT_EQ(rows_of(s, Part::fitted).size(), 3u);
  EXPECT_EQ(rows_of(s, Part::held_out).size(), 2u);
  EXPECT_EQ(rows_of(s, Part::held_out)[0].rpm, 2.0);
  s.fitted = false;
  EXPECT_TRUE(rows_of(s, Part::fitted).empty());
  EXPECT_EQ(rows_of(s, Part::held_out).size(), 5u);
}
TEST(Protocol, FittedSweepReachesZeroThrustAndLiesInTheMiddleOfTheSpeeds) {
  const auto made = [](double rpm, double last_ct) { return MeasuredSet{"", {{rpm, 0.1, 0.1, 0.1}, {rpm, 0.8, last_ct, 0.02}}}; };
  const MeasuredSet fixed{"static", {{3000, 0, .1, .1}}, true};
  EXPECT_EQ(sweep_to_fit({fixed, made(3000, 0.0), made(5000, 0.0), made(6000, 0.0)}), 2u);
  EXPECT_EQ(sweep_to_fit({fixed, made(3000, 0.0), made(5000, 0.02), made(6000, 0.0)}), 3u);  // 5000 stops at C_T 0.02
  EXPECT_EQ(sweep_to_fit({fixed, made(3000, 0.05), made(5000, 0.02)}), 0u);
  EXPECT_EQ(sweep_to_fit({fixed, made(3000, 0.05), made(5000, 0.0)}, 2000.0), 1u);  // asked for by its speed
}
TEST(Score, IsTheRmsOfRelativeErrorsAboveThrust0p01) {
  const sim::Rotor rotor(blade());
  MeasuredRow exact = solved(rotor, 6000.0, 0.3), low = exact, tiny = exact;
  low.ct /= 1.10;  // the model is 10 % above it
  tiny.ct = 0.009;
  const ErrorRms e = score(rotor, kDiameter_m, {exact, low, tiny});
  EXPECT_EQ(e.rows, 2);
  EXPECT_NEAR(e.ct, 0.10 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(e.cp, 0.0, 1e-12);
}

class SyntheticPropeller : public ::testing::Test {
 protected:
  // Pitch offset, lift scale, drag scale, stall delay.
  const std::vector<double> truth{1.3, 0.93, 1.35, 1.8};
  const sim::Rotor real{with_parameters(blade(), truth)};

  PropellerResult validated() const {
    MeasuredPropeller p;
    p.entry.title = "made up";
    p.entry.diameter_m = kDiameter_m;
    p.entry.judged = true;
    sim::Blade wrong = blade();
    for (auto& s : wrong.stations) s.chord_m *= 0.8;
    p.geometries = {{"mould", wrong}, {"photo", blade()}};
    p.sets = {static_set(real), sweep(real, 5000, 0.6), sweep(real, 7000, 0.9)};
    p.sets[2].fitted = true;
    return validate(p);
  }
};
TEST_F(SyntheticPropeller, FitFindsTheFourScalarsThatMadeTheRows) {
  std::vector<MeasuredRow> rows = static_set(real).rows;
  for (const MeasuredRow& r : sweep(real, 6000, 0.9).rows) rows.push_back(r);
  const auto fit = fit_blade(blade(), kDiameter_m, rows);
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(fit.rms, 1e-4);
  EXPECT_NEAR(fit.values[0], truth[0], 0.01) << "deg";
  EXPECT_NEAR(fit.values[1], truth[1], 0.002);
  EXPECT_NEAR(fit.values[2], truth[2], 0.01);
  EXPECT_NEAR(fit.values[3], truth[3], 0.05);
}
TEST_F(SyntheticPropeller, HeldOutRowsArePredictedAndTheGeometryThatFitsBetterIsJudged) {
  const PropellerResult r = validated();
  ASSERT_EQ(r.geometries.size(), 2u);
  EXPECT_FALSE(r.geometries[0].judged);
  EXPECT_TRUE(r.geometries[1].judged);
  for (const SetScore& s : r.geometries[1].scores) {
    EXPECT_LT(s.fitted.ct, 0.005) << s.label;
    EXPECT_GT(s.unfitted.cp, 0.05) << s.label;
  }
}
TEST_F(SyntheticPropeller, LimitsAreJudgedOnHeldOutRowsOfTheJudgedGeometryAndCanBeMissed) {
  PropellerResult r = validated();
  const auto passed = judge({r});
  ASSERT_EQ(passed.size(), 4u);  // static C_T and C_P, worst sweep; the share needs all propellers of the catalogue
  EXPECT_TRUE(all_pass(passed));
  for (SetScore& s : r.geometries[1].scores)
    if (s.whole) s.fitted.cp = 0.16;
  const auto missed = judge({r});
  EXPECT_FALSE(all_pass(missed));
  EXPECT_FALSE(missed[3].pass);
  for (SetScore& s : r.geometries[1].scores) s.judged = false;
  EXPECT_TRUE(judge({r}).empty());
}
TEST_F(SyntheticPropeller, PageTextAndJsonCarryTheFiguresAndTheVerdict) {
  ValidationDocument d{.results = {validated()}, .limits = {}, .version = "v", .command = "c"};
  d.limits = judge(d.results);
  d.limits[0].pass = false;
  EXPECT_THAT(validation_text(d), HasSubstr("MISSED"));
  EXPECT_THAT(validation_text(d), HasSubstr("geometry photo (judged)"));
  EXPECT_THAT(validation_json(d), HasSubstr("\"verdict\": \"fail\""));
  const std::string page = validation_html(d);
  EXPECT_THAT(page, HasSubstr("1 of 4 limits missed"));
  EXPECT_THAT(page, HasSubstr("held out, whole sweep"));
  EXPECT_THAT(page, Not(AnyOf(HasSubstr(">nan"), HasSubstr(" nan"), HasSubstr("NaN"))));  // Ananda is a name
}

}  // namespace
}  // namespace rotorloop::propeller
