// The fast solve and the reference rotor are two programs for one set of equations; where they agree, both are what they claim.
// The other conventions are checked against closed forms of the theory they come from.
#include "sim/rotor/reference/reference_rotor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "host/base/error.hpp"
#include "sim/rotor/inflow.hpp"
#include "sim/rotor/reference/momentum.hpp"
#include "test/support/reference_blade.hpp"
#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
const ReferenceRotor& second_program() {
  static const ReferenceRotor r(reference_geometry(test::triblade(), 96), {}, 48);
  return r;
}
struct Deviation {
  double thrust, torque, in_plane, moment;
};
// Of the reference rotor from the fast solve at 64 x 128 nodes, relative. Near a zero of a load its scale is a fifth of hover thrust
// for thrust, 2 % of thrust for the in-plane force, and that times the radius for the hub moment.
Deviation deviation(const RotorCondition& c) {
  const RotorLoads fast = test::solve_cold(test::reference_rotor(), c), slow = second_program().solve(c).loads;
  const double T = std::max(std::fabs(fast.force_R_N.z()), 0.2 * test::kHoverThrust_N), R = test::triblade().radius_m;
  const auto relative = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double least) {
    return (a - b).head<2>().norm() / std::max(b.head<2>().norm(), least);
  };
  const Deviation d{std::fabs(slow.force_R_N.z() - fast.force_R_N.z()) / T,
                    std::fabs(slow.shaft_torque_N_m - fast.shaft_torque_N_m) / std::fabs(fast.shaft_torque_N_m),
                    relative(slow.force_R_N, fast.force_R_N, 0.02 * T), relative(slow.moment_R_N_m, fast.moment_R_N_m, 0.02 * T * R)};
  std::printf("[ measured ] v (%.1f %.1f %.1f) m/s, %.0f rad/s: T %.3f %% Q %.3f %% H %.3f %% M %.3f %%\n", c.v_R_m_s.x(), c.v_R_m_s.y(),
              c.v_R_m_s.z(), c.omega_rad_s, 100 * d.thrust, 100 * d.torque, 100 * d.in_plane, 100 * d.moment);
  return d;
}
// The hub moment follows the slope of the lift curve, which the fast solve's table of straight cells keeps to 0.4 % only.
void expect_the_same(const RotorCondition& c) {
  const Deviation d = deviation(c);
  EXPECT_LT(d.thrust, 1e-3);
  EXPECT_LT(d.torque, 1e-3);
  EXPECT_LT(d.in_plane, 1e-3);
  EXPECT_LT(d.moment, 4e-3);
}

TEST(SecondProgram, AgreesWithTheFastSolveInHoverAndClimbWithinATenthPercent) {
  for (double climb : {0.0, 1.5, 3.5, 6.0, 8.0}) expect_the_same(test::at(0, 0, climb, 950));
}
TEST(SecondProgram, AgreesWithTheFastSolveEdgewiseWithinATenthPercent) {
  for (double v : {2.0, 4.0, 8.5, 12.0, 18.0}) expect_the_same(test::at(v, -0.3 * v, 0.5, 950));
}
TEST(SecondProgram, AgreesWithTheFastSolveInDescentThroughTheRingWithinATenthPercent) {
  for (double sink : {1.0, 2.5, 4.0, 6.0, 8.0}) expect_the_same(test::at(1.0, 0, -sink, 950));
}
TEST(SecondProgram, AgreesWithTheFastSolveWithBodyRatesAndClockwiseSpinWithinATenthPercent) {
  RotorCondition c = test::at(6.0, 3.0, -1.0, 1100, -1);
  c.w_R_rad_s = {4.0, -6.0, 2.0};
  expect_the_same(c);
}
TEST(SecondProgram, MassFlowOfTheRingAgreesWithTheFastSolvesTable) {
  double worst = 0.0;
  for (double climb = -25.0; climb <= 5.0; climb += 0.37)
    for (double edge : {0.0, 1.0, 3.0, 6.0})
      for (double v : {2.0, 7.5, 12.0}) {
        const double fast = mass_flow(v, climb, edge * edge).speed_m_s;
        const double relative = std::fabs(reference_mass_flow(v, climb, edge, Descent::ring).speed_m_s - fast) / v;
        EXPECT_LT(relative, 2e-4) << climb << " " << edge << " " << v;
        worst = std::max(worst, relative);
      }
  std::printf("[ measured ] mass flow of the ring: %.4f %% of the induced velocity\n", 100 * worst);
}

// An untwisted, untapered blade with a given section, uniform strips.
ReferenceGeometry plain_blade(int blades, double chord_m, double pitch_rad, const Section& section, double hub_m = 0.0) {
  constexpr double kR = 0.1;
  ReferenceGeometry g{blades, kR, hub_m, {}};
  constexpr int n = 200;
  const double width = (kR - hub_m) / n;
  for (int i = 0; i < n; ++i) g.elements.push_back({hub_m + (i + 0.5) * width, width, chord_m, pitch_rad, section});
  return g;
}
RotorConventions textbook() {
  RotorConventions c;
  c.inflow = Inflow::uniform;
  c.descent = Descent::momentum;
  c.edge_loss = EdgeLoss::none;
  c.swirl = c.skew = c.spanwise_drag = false;
  return c;
}

// C_T = sigma a / 2 (theta / 3 - lambda / 2) with C_T = 2 lambda^2, small angles (Leishman 2006, ch. 3).
TEST(Textbook, HoverThrustOfAnUntwistedBladeFollowsTheClosedFormWithin1Percent) {
  constexpr double a = 5.7, chord = 0.01, R = 0.1, omega = 500, pitch = 0.14;
  const ReferenceRotor rotor(plain_blade(2, chord, pitch, linear_section(a, 0.0)), textbook(), 4);
  const RotorLoads l = rotor.solve(test::at(0, 0, 0, omega)).loads;
  const double sigma = 2 * chord / (std::numbers::pi * R), tip = omega * R;
  const double g = sigma * a / 16.0;
  const double lambda = g * (std::sqrt(1.0 + 4.0 / 3.0 * pitch / g) - 1.0);
  const double ct = l.force_R_N.z() / (test::kDensity * rotor.disk_area_m2() * tip * tip);
  EXPECT_NEAR(ct / (2 * lambda * lambda), 1.0, 0.01);
  EXPECT_NEAR(l.induced_m_s / (lambda * tip), 1.0, 0.005);
}
// H = sigma cd mu / 4 and Q = sigma cd (1 + mu^2) / 8 of a blade that only drags: Leishman 2006, section 5.4, no reverse flow.
TEST(Textbook, ProfileDragEdgewiseFollowsTheClosedFormsWithinAHalfPercent) {
  constexpr double cd = 0.02, chord = 0.01, R = 0.1, omega = 500, mu = 0.1;
  const ReferenceRotor rotor(plain_blade(2, chord, 0.0, linear_section(0.0, cd)), textbook(), 64);
  const RotorLoads l = rotor.at_induced(test::at(mu * omega * R, 0, 0, omega), 0.0).loads;
  const double sigma = 2 * chord / (std::numbers::pi * R), unit = test::kDensity * rotor.disk_area_m2() * omega * omega * R * R;
  EXPECT_NEAR(-l.force_R_N.x() / (unit * sigma * cd * mu / 4), 1.0, 0.005);
  EXPECT_NEAR(l.shaft_torque_N_m / (unit * R * sigma * cd * (1 + mu * mu) / 8), 1.0, 0.005);
  EXPECT_NEAR(l.force_R_N.z(), 0.0, 1e-12);
}
// With very many narrow blades the helical wake becomes the actuator disk: thrust is the momentum of the air through each ring.
TEST(Circulation, OfTwoHundredBladesIsTheActuatorDiskWithinATenthPercent) {
  RotorConventions c = textbook();
  c.inflow = Inflow::circulation;
  for (double climb : {0.0, 5.0, 15.0}) {
    const ReferenceGeometry g = plain_blade(200, 1e-4, 0.35, linear_section(5.7, 0.0), 0.02);
    const ReferenceSolution s = ReferenceRotor(g, c, 4).solve(test::at(0, 0, climb, 700));
    double momentum_N = 0.0;
    for (std::size_t i = 0; i < s.stations.size(); ++i)
      momentum_N += 4 * std::numbers::pi * test::kDensity * s.stations[i].r_m * g.elements[i].width_m * s.stations[i].induced_m_s *
                    s.stations[i].axial_m_s;
    EXPECT_GT(momentum_N, 0.05);
    EXPECT_NEAR(s.loads.force_R_N.z() / momentum_N, 1.0, 1e-3) << climb;
  }
}
TEST(Circulation, OfTwoBladesLosesTipThrustAgainstTheDiskBetween5And25Percent) {
  RotorConventions with = textbook();
  with.inflow = Inflow::circulation;
  RotorConventions without = with;
  with.edge_loss = EdgeLoss::tip;
  const ReferenceGeometry g = plain_blade(2, 0.01, 0.25, linear_section(5.7, 0.0), 0.02);
  const double lossy = ReferenceRotor(g, with, 4).solve(test::at(0, 0, 0, 700)).loads.force_R_N.z();
  const double disk = ReferenceRotor(g, without, 4).solve(test::at(0, 0, 0, 700)).loads.force_R_N.z();
  EXPECT_LT(lossy, 0.95 * disk);
  EXPECT_GT(lossy, 0.75 * disk);
}

// What each choice is worth in hover for the shipped tri-blade: the size that a comparison with another code may differ by.
double hover_thrust_with(const RotorConventions& c) {
  return ReferenceRotor(reference_geometry(test::triblade(), 96), c, 8).solve(test::at(0, 0, 0, 950)).loads.force_R_N.z();
}
TEST(Conventions, EachSwitchMovesHoverThrustOfTheTribladeByItsOwnAmount) {
  const double plain = hover_thrust_with({});
  const auto percent = [&](const char* name, RotorConventions c) {
    const double change = 100 * (hover_thrust_with(c) / plain - 1);
    std::printf("[ measured ] hover thrust, %s: %+.2f %%\n", name, change);
    return change;
  };
  RotorConventions c;
  c.edge_loss = EdgeLoss::none;
  const double no_loss = percent("no edge loss", c);
  EXPECT_GT(no_loss, 3.0);
  EXPECT_LT(no_loss, 20.0);
  c = {};
  c.edge_loss = EdgeLoss::tip;
  const double tip_only = percent("tip loss only", c);
  EXPECT_GT(tip_only, 0.0);
  EXPECT_LT(tip_only, no_loss);
  c = {};
  c.sheet_spread = false;
  EXPECT_LT(std::fabs(percent("sheets not spread", c)), 1.0);  // decision 0021 says 0.3 %
  c = {};
  c.swirl = false;
  EXPECT_GT(percent("no swirl", c), 0.0);
  c = {};
  c.compressibility = true;
  const double compressed = percent("Prandtl-Glauert", c);
  EXPECT_GT(compressed, 0.2);
  EXPECT_LT(compressed, 2.0);
  c = {};
  c.inflow = Inflow::uniform;
  percent("uniform inflow, no edge loss", c);
}
TEST(Conventions, SkewGivesTheHubMomentAndSpanwiseDragPartOfTheInPlaneForce) {
  const auto edgewise = [](const RotorConventions& c) {
    return ReferenceRotor(reference_geometry(test::triblade(), 96), c, 32).solve(test::at(8.5, 0, 0, 950)).loads;
  };
  RotorConventions flat, smooth;
  flat.skew = false;
  smooth.spanwise_drag = false;
  const RotorLoads all = edgewise({}), no_skew = edgewise(flat), no_span = edgewise(smooth);
  // More inflow downstream: more lift at the front, nose up.
  EXPECT_LT(all.moment_R_N_m.y(), no_skew.moment_R_N_m.y());
  EXPECT_LT(all.force_R_N.x(), no_span.force_R_N.x());
  EXPECT_LT(no_span.force_R_N.x(), 0.0);
}
TEST(Conventions, FactorsScaleTheResultAndNotTheBalance) {
  RotorConventions c;
  c.in_plane_factor = 3.0;
  c.thrust_factor = 0.9575;
  const ReferenceGeometry g = reference_geometry(test::triblade(), 48);
  const RotorLoads plain = ReferenceRotor(g, {}, 16).solve(test::at(6, 0, 0, 950)).loads;
  const RotorLoads scaled = ReferenceRotor(g, c, 16).solve(test::at(6, 0, 0, 950)).loads;
  EXPECT_DOUBLE_EQ(scaled.force_R_N.x(), 3.0 * plain.force_R_N.x());
  EXPECT_DOUBLE_EQ(scaled.force_R_N.z(), 0.9575 * plain.force_R_N.z());
  EXPECT_DOUBLE_EQ(scaled.induced_m_s, plain.induced_m_s);
}
TEST(Conventions, DescentQuarticIsAppliedBetweenMomentumAndTwiceHover) {
  RotorConventions c = textbook();
  const ReferenceGeometry g = plain_blade(2, 0.01, 0.2, linear_section(5.7, 0.01));
  const auto induced = [&](Descent d, double climb) {
    c.descent = d;
    return ReferenceRotor(g, c, 4).solve(test::at(0, 0, climb, 500)).loads.induced_m_s;
  };
  const double hover = induced(Descent::momentum, 0.0);
  EXPECT_NEAR(induced(Descent::quartic, -0.5 * hover), hover * descent_quartic(-0.5), 1e-9);
  EXPECT_DOUBLE_EQ(induced(Descent::quartic, 2.0), induced(Descent::momentum, 2.0));
  EXPECT_LE(induced(Descent::quartic, -1.8 * hover), 2.0 * hover);
}

TEST(Refusal, EdgewiseFlowAndDescentAreNotForTheCirculationForm) {
  RotorConventions c;
  c.inflow = Inflow::circulation;
  const ReferenceRotor rotor(reference_geometry(test::triblade(), 8), c, 4);
  EXPECT_THROW(rotor.solve(test::at(1, 0, 0, 900)), Error);
  EXPECT_THROW(rotor.solve(test::at(0, 0, -1, 900)), Error);
  EXPECT_NO_THROW(rotor.solve(test::at(0, 0, 1, 900)));
}
TEST(Refusal, NoElementsFewAzimuthsOrAnAnnularQuarticAreNamed) {
  EXPECT_THROW(ReferenceRotor({}, {}, 8), Error);
  EXPECT_THROW(ReferenceRotor(reference_geometry(test::triblade(), 8), {}, 2), Error);
  RotorConventions c;
  c.descent = Descent::quartic;
  EXPECT_THROW(ReferenceRotor(reference_geometry(test::triblade(), 8), c, 8), Error);
}
}  // namespace
}  // namespace rotorloop::sim
