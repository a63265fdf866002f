// A rotor's coefficients and its page: definitions as on data sheets, the advancing blade on its side, one file that needs nothing.
#include "bench/propeller/report/rotor_plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bench/propeller/report/blade_figures.hpp"
#include "bench/propeller/report/disk_figures.hpp"
#include "bench/propeller/rotor_sweep.hpp"
#include "bench/render/svg_pieces.hpp"
#include "host/base/error.hpp"
#include "test/unit/bench/markup.hpp"

namespace rotorloop::propeller {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
constexpr double kPi = std::numbers::pi;

const sim::Blade& triblade() {
  static const sim::Blade blade = sim::read_blade(std::string(ROTORLOOP_SOURCE_DIR) + "/vehicles/blades/triblade_5in.toml");
  return blade;
}
const sim::Rotor& rotor() {
  static const sim::Rotor r(triblade());
  return r;
}
sim::RotorCondition at(double climb_m_s, double edgewise_m_s, int spin = 1) {
  sim::RotorCondition c;
  c.v_R_m_s = {edgewise_m_s, 0, climb_m_s};
  c.omega_rad_s = 9000 * kPi / 30;
  c.spin = spin;
  c.density_kg_m3 = 1.2;
  return c;
}

// --- coefficients ---
TEST(RotorCoefficients, OneNewtonAnd20MillinewtonmetresAt100TurnsPerSecondOfA5InchPropeller) {
  sim::RotorCondition c;
  c.omega_rad_s = 200 * kPi;
  c.density_kg_m3 = 1.2;
  c.v_R_m_s = {0, 0, 5};
  sim::RotorLoads loads;
  loads.force_R_N = {0, 0, 1};
  loads.shaft_torque_N_m = 0.02;
  const RotorCoefficients k = rotor_coefficients(loads, c, 0.0635);
  EXPECT_NEAR(k.c_t, 0.32034, 1e-5);               // 1 / (1.2 * 100^2 * 0.127^4)
  EXPECT_NEAR(k.c_p, 0.31696, 1e-5);               // 4 pi / (1.2 * 100^3 * 0.127^5)
  EXPECT_NEAR(k.eta, 1.0 * 5 / (4 * kPi), 1e-12);  // thrust power over shaft power
  EXPECT_NEAR(advance_ratio(c, 0.0635), 5 / 12.7, 1e-12);
}
TEST(RotorCoefficients, DragAndMomentsAreAlongTheEdgewiseMotionWhereverItPoints) {
  // The same load and motion, turned about the shaft.
  for (const double turn : {0.0, 0.7, kPi / 2, 3.0, -2.0}) {
    const auto turned = [&](double along, double left, double up) {
      return Eigen::Vector3d(along * std::cos(turn) - left * std::sin(turn), along * std::sin(turn) + left * std::cos(turn), up);
    };
    sim::RotorCondition c;
    c.omega_rad_s = 200 * kPi;
    c.density_kg_m3 = 1.2;
    c.v_R_m_s = turned(8, 0, 0);
    sim::RotorLoads loads;
    loads.force_R_N = turned(-0.1, 0, 1);
    loads.moment_R_N_m = turned(-3e-3, 2e-3, 0);
    const RotorCoefficients k = rotor_coefficients(loads, c, 0.0635);
    EXPECT_NEAR(k.c_h, 0.032034, 1e-6) << turn;
    EXPECT_NEAR(k.c_roll, -3e-3 / 0.127 * 0.32034, 1e-6) << turn;
    EXPECT_NEAR(k.c_pitch, 2e-3 / 0.127 * 0.32034, 1e-6) << turn;
  }
}
TEST(RotorCoefficients, AdvanceRatioIsPiTimesTheEdgewiseOneOfTheSameSpeed) {
  EXPECT_NEAR(advance_ratio(at(7, 0), 0.0635), kPi * edgewise_advance_ratio(at(0, 7), 0.0635), 1e-12);
}
TEST(RotorCoefficients, NoEfficiencyWithoutThrust) {
  sim::RotorLoads windmill;
  windmill.force_R_N = {0, 0, -1};
  windmill.shaft_torque_N_m = 0.01;
  EXPECT_TRUE(std::isnan(rotor_coefficients(windmill, at(30, 0), 0.0635).eta));
}
TEST(FigureOfMerit, IsOneWhenTheShaftGivesNoMoreThanThrustTimesInducedVelocity) {
  const sim::RotorCondition c = at(0, 0);
  sim::RotorLoads ideal;
  ideal.force_R_N = {0, 0, 1.6};
  ideal.shaft_torque_N_m = 1.6 * momentum_theory_induced_m_s(1.6, 0, 1.2, kPi * 0.0635 * 0.0635) / c.omega_rad_s;
  EXPECT_NEAR(figure_of_merit(ideal, c, 0.0635), 1, 1e-12);
}
TEST(MomentumTheory, ThrustIsTheMassFlowTimesTwiceTheInducedVelocity) {
  const double area = 0.0127, rho = 1.2, hover = momentum_theory_induced_m_s(1.6, 0, rho, area);
  EXPECT_NEAR(2 * rho * area * hover * hover, 1.6, 1e-12);
  const double climb = momentum_theory_induced_m_s(1.6, 5, rho, area);
  EXPECT_NEAR(2 * rho * area * (5 + climb) * climb, 1.6, 1e-12);
  const double windmill = momentum_theory_induced_m_s(1.6, -3 * hover, rho, area);
  EXPECT_NEAR(2 * rho * area * (3 * hover - windmill) * windmill, 1.6, 1e-12);
  EXPECT_TRUE(std::isnan(momentum_theory_induced_m_s(1.6, -hover, rho, area))) << "vortex ring";
}

// --- sweeps ---
TEST(AdvanceSweep, RunsFromHoverToTheFirstPointWithoutThrust) {
  const auto points = advance_sweep(rotor(), at(0, 0));
  ASSERT_GT(points.size(), 20u);
  EXPECT_EQ(points.front().condition.v_R_m_s.z(), 0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_NEAR(advance_ratio(points[i].condition, rotor().radius_m()), 0.02 * static_cast<double>(i), 1e-12);
    EXPECT_EQ(points[i].coefficients.c_t < 0, i + 1 == points.size());
  }
  EXPECT_GT(advance_ratio(points.back().condition, rotor().radius_m()), 4.3 / 5) << "a cambered blade lifts beyond its geometric pitch";
}
TEST(AdvanceSweep, AtFourTimesTheReynoldsNumberTheBladeLiftsMoreAndGlidesBetter) {
  sim::RotorCondition slow = at(0, 0), fast = slow;
  slow.omega_rad_s /= 2;
  fast.omega_rad_s *= 2;
  const auto a = advance_sweep(rotor(), slow), b = advance_sweep(rotor(), fast);
  EXPECT_GT(b[0].coefficients.c_t, 1.05 * a[0].coefficients.c_t);
  const auto best = [](const auto& points) {
    double most = 0;
    for (const auto& p : points) most = std::fmax(most, p.coefficients.eta);
    return most;
  };
  EXPECT_GT(best(b), best(a) + 0.05);
  EXPECT_LT(best(b), 0.9);
}
TEST(EdgewiseSweep, DragRisesAndTheRollingMomentTurnsWithTheSpin) {
  const auto ccw = edgewise_sweep(rotor(), at(0, 0, 1), 0, 0.3, 4), cw = edgewise_sweep(rotor(), at(0, 0, -1), 0, 0.3, 4);
  EXPECT_NEAR(edgewise_advance_ratio(ccw.back().condition, rotor().radius_m()), 0.3, 1e-12);
  for (std::size_t i = 1; i < ccw.size(); ++i) {
    EXPECT_GT(ccw[i].coefficients.c_h, ccw[i - 1].coefficients.c_h);
    EXPECT_LT(ccw[i].coefficients.c_roll, -1e-3) << "the advancing blade is on the right and lifts more: left edge down";
    EXPECT_NEAR(cw[i].coefficients.c_roll, -ccw[i].coefficients.c_roll, 1e-9);
    EXPECT_NEAR(cw[i].coefficients.c_pitch, ccw[i].coefficients.c_pitch, 1e-9);
  }
}
TEST(ClimbSweep, LeadsFromTheWindmillThroughTheVortexRingToTheNormalWorkingState) {
  const auto points = climb_sweep(rotor(), at(0, 0), -29, 14, 44);
  std::vector<sim::InflowStatus> seen;
  for (const auto& p : points)
    if (seen.empty() || seen.back() != p.loads.status) seen.push_back(p.loads.status);
  EXPECT_THAT(seen, ::testing::ElementsAre(sim::InflowStatus::windmill, sim::InflowStatus::vortex_ring, sim::InflowStatus::converged));
}

TEST(ClimbSweep, BothDirectionsAgreeInClimbHoverAndSlowDescent) {
  const auto down = climb_sweep(rotor(), at(0, 0), 6, -8, 57), up = climb_sweep(rotor(), at(0, 0), -8, 6, 57);
  for (std::size_t i = 0; i < up.size(); ++i)
    EXPECT_NEAR(up[i].loads.induced_m_s, down[up.size() - 1 - i].loads.induced_m_s, 1e-8) << up[i].condition.v_R_m_s.z();
}

// --- blade ---
TEST(BladeSolidity, IsTheAreaUnderTheChordsOfTheFile) {
  double area_m2 = 0;  // trapezes between the stations; the hub's end has the first chord
  const auto& s = triblade().stations;
  area_m2 += (s.front().r_m - triblade().hub_radius_m) * s.front().chord_m;
  for (std::size_t i = 1; i < s.size(); ++i) area_m2 += (s[i].r_m - s[i - 1].r_m) * (s[i].chord_m + s[i - 1].chord_m) / 2;
  const double solidity = 3 * area_m2 / (kPi * 0.0635 * 0.0635);
  EXPECT_NEAR(blade_solidity(rotor()), solidity, 0.01 * solidity);
}

// --- disk maps ---
// Sum of a map's values to the left (y > 0) less that to the right, over the sum of both.
double leftward(const render::DiskMap& m) {
  double left = 0, right = 0;
  for (std::size_t i = 0; i < m.values.size(); ++i)
    (i % static_cast<std::size_t>(m.sectors) < m.values.size() / (m.ring_edges_m.size() - 1) / 2 ? left : right) += m.values[i];
  return (left - right) / (left + right);
}
TEST(DiskFigures, TheAdvancingBladeIsOnTheRightWhenTurningCounterClockwiseAndOnTheLeftWhenClockwise) {
  for (const int spin : {1, -1}) {
    const auto c = at(0, 8.5, spin);
    const auto disk = sim::solve_rotor_disk(rotor(), c);
    const DiskQuantity reynolds = [](const sim::DiskCell& cell) { return cell.reynolds; };
    const DiskQuantity thrust = [](const sim::DiskCell& cell) { return cell.thrust_N_per_m2; };
    EXPECT_LT(spin * leftward(disk_map_of(rotor(), c, disk, reynolds, "Re")), -0.1) << spin;
    EXPECT_LT(spin * leftward(disk_map_of(rotor(), c, disk, thrust, "T")), -0.1) << spin;
    EXPECT_EQ(disk_map_of(rotor(), c, disk, thrust, "T").spin, spin);
  }
}
TEST(DiskFigures, CellsHaveTheAreaOfTheDiskAndTheirThrustIsTheRotors) {
  const auto c = at(2, 6);
  const auto disk = sim::solve_rotor_disk(rotor(), c);
  const auto m = disk_map_of(
      rotor(), c, disk, [](const sim::DiskCell& cell) { return cell.thrust_N_per_m2; }, "T");
  double thrust_N = 0;
  for (std::size_t ring = 0; ring + 1 < m.ring_edges_m.size(); ++ring) {
    const double in = m.ring_edges_m[ring], out = m.ring_edges_m[ring + 1];
    EXPECT_TRUE(in < rotor().annuli()[ring].r_m && rotor().annuli()[ring].r_m < out) << ring;
    for (int k = 0; k < m.sectors; ++k)
      thrust_N +=
          kPi * (out * out - in * in) / m.sectors * m.values[ring * static_cast<std::size_t>(m.sectors) + static_cast<std::size_t>(k)];
  }
  EXPECT_NEAR(thrust_N, disk.loads.force_R_N.z(), 1e-3 * thrust_N);
}
TEST(DiskFigures, TheWindComesFromWhereTheRotorFliesTo) {
  sim::RotorCondition c = at(0, 0);
  const auto map = [&] {
    return disk_map_of(
        rotor(), c, sim::solve_rotor_disk(rotor(), c), [](const sim::DiskCell& cell) { return cell.through_m_s; }, "U");
  };
  EXPECT_FALSE(map().wind_from_rad.has_value()) << "axial flow";
  c.v_R_m_s = {0, 5, 0};
  EXPECT_NEAR(map().wind_from_rad.value(), kPi / 2, 1e-12);
}

// --- page ---
RotorPlotRequest request(double climb_m_s, double edgewise_m_s) {
  return {.title = "a <blade> & co", .source = "blade.toml", .version = "test", .condition = at(climb_m_s, edgewise_m_s)};
}
TEST(RotorPage, IsBalancedSmallAndNeedsNothingButItself) {
  const auto html = rotor_plot_html(triblade(), request(0, 8.5));
  EXPECT_EQ(test::unbalanced(html), "");
  EXPECT_LT(html.size(), 2'000'000u);
  for (const auto* part : {"http:", "https:", "<script", "<link", "@import", "url(", "src=", ">nan<", "nan ", "inf "})
    EXPECT_THAT(html, Not(HasSubstr(part)));
  EXPECT_THAT(html, AllOf(HasSubstr("a &lt;blade&gt; &amp; co"), HasSubstr("9000 RPM"), HasSubstr("18000 RPM"), HasSubstr("vortex ring"),
                          HasSubstr("more than one balance"), HasSubstr("wind 8.5 m/s"), HasSubstr("naca4410"), HasSubstr("5.00 in")));
  EXPECT_EQ(html, rotor_plot_html(triblade(), request(0, 8.5))) << "the same bytes every time";
}
TEST(RotorPage, StatesTheLoadsOfTheConditionAskedFor) {
  sim::RotorWarmStart cold;
  const auto loads = sim::solve_rotor(rotor(), at(-3, 6), cold);
  const auto html = rotor_plot_html(triblade(), request(-3, 6));
  EXPECT_THAT(html, HasSubstr(render::tick_text(loads.force_R_N.z(), 3) + " N</td>"));
  EXPECT_THAT(html, HasSubstr(render::tick_text(1e3 * loads.shaft_torque_N_m, 2) + " mN m</td>"));
}
TEST(RotorPage, WarnsOfATipTooFastForThePolars) {
  auto r = request(0, 0);
  EXPECT_THAT(rotor_plot_html(triblade(), r), Not(HasSubstr("class=\"warn\"")));
  r.condition.omega_rad_s = 35'000 * kPi / 30;
  EXPECT_THAT(rotor_plot_html(triblade(), r), HasSubstr("highest tip Mach number is 0.68"));
}
TEST(RotorPage, OfARotorThatHardlyTurnsIsRefusedWithTheSpeed) {
  auto r = request(0, 0);
  r.condition.omega_rad_s = 10;
  try {
    rotor_plot_html(triblade(), r);
    FAIL() << "a page was made";
  } catch (const Error& e) {
    EXPECT_EQ(e.exit_code(), ExitCode::usage);
    EXPECT_THAT(e.what(), AllOf(HasSubstr("95 RPM"), HasSubstr("0.64 m/s"), HasSubstr("--rpm")));
  }
}
TEST(RotorPage, IsMadeOfExtremesToo) {
  for (const auto& [climb, edgewise] : {std::pair{-60.0, 0.0}, {60.0, 60.0}, {-20.0, 20.0}}) {
    const auto html = rotor_plot_html(triblade(), request(climb, edgewise));
    EXPECT_EQ(test::unbalanced(html), "") << climb;
    for (const auto* part : {">nan", "nan<", "nan ", "\"nan", "inf ", "inf<"})
      EXPECT_EQ(html.find(part), std::string::npos) << climb << ": " << html.substr(html.find(part) - 60, 120);
  }
}

}  // namespace
}  // namespace rotorloop::propeller
