// The unfitted solve against a measured 5-inch propeller: DA4002 5x3.75, two blades (UIUC Propeller Database, Brandt, Deters,
// Ananda, Dantsker, Selig). Geometry and measurements stay in the data folder; polars are ours.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "test/unit/sim/rotor/fixtures.hpp"

namespace rotorloop::sim {
namespace {
struct Row {
  double first, second, third;
};
std::vector<Row> read_rows(const std::string& name) {
  std::ifstream in(std::string(std::getenv("ROTORLOOP_DATA")) + "/propellers/da4002_5x3.75/da4002_5x3.75_" + name + ".txt");
  std::vector<Row> rows;
  for (std::string line; std::getline(in, line);) {
    std::istringstream s(line);
    Row r{};
    if (s >> r.first >> r.second >> r.third) rows.push_back(r);
  }
  return rows;
}

constexpr double kRadius_m = 0.0635;  // 5 in

Blade measured_blade(const std::string& polar, double stall_delay) {
  Blade b;
  b.blades = 2;
  b.radius_m = kRadius_m;
  b.hub_radius_m = 0.12 * kRadius_m;  // inside the first station, 0.15 R
  b.stall_delay = stall_delay;
  for (const Row& r : read_rows("geom")) b.stations.push_back({r.first * kRadius_m, r.second * kRadius_m, r.third, polar});
  b.polars.emplace(polar, read_polar(ROTORLOOP_SOURCE_DIR "/vehicles/polars/" + polar + ".toml"));
  return b;
}

struct Score {
  int rows = 0;
  double thrust_rms = 0, power_rms = 0;  // relative to the rms of the measured coefficient
};
// rpm 0: a static table (rpm, CT, CP); otherwise an advance sweep (J, CT, CP) at that rpm, rows with CT > 0.01.
Score compare(const Rotor& rotor, const std::string& name, double rpm) {
  Score s;
  double ct2 = 0, cp2 = 0, dt2 = 0, dp2 = 0;
  for (const Row& row : read_rows(name)) {
    if (row.second <= 0.01) continue;
    const double n = (rpm > 0 ? rpm : row.first) / 60.0, diameter = 2 * kRadius_m;
    const RotorLoads l = test::solve_cold(rotor, test::at(0, 0, rpm > 0 ? row.first * n * diameter : 0.0, 2 * std::numbers::pi * n));
    const double ct = l.force_R_N.z() / (test::kDensity * n * n * std::pow(diameter, 4));
    const double cp = 2 * std::numbers::pi * l.shaft_torque_N_m / (test::kDensity * n * n * std::pow(diameter, 5));
    ct2 += row.second * row.second;
    cp2 += row.third * row.third;
    dt2 += (ct - row.second) * (ct - row.second);
    dp2 += (cp - row.third) * (cp - row.third);
    ++s.rows;
  }
  s.thrust_rms = std::sqrt(dt2 / ct2);
  s.power_rms = std::sqrt(dp2 / cp2);
  return s;
}

class MeasuredPropeller : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::getenv("ROTORLOOP_DATA") == nullptr) GTEST_SKIP() << "ROTORLOOP_DATA is not set: measured propeller data not checked";
  }
  void record(const std::string& name, const Score& s) {
    RecordProperty(name, std::to_string(100 * s.thrust_rms) + " " + std::to_string(100 * s.power_rms));
    std::printf("[ measured ] %s: %d rows, CT %.1f %%, CP %.1f %% rms\n", name.c_str(), s.rows, 100 * s.thrust_rms, 100 * s.power_rms);
  }
};

Blade scaled_drag(Blade b, double drag_scale) {
  b.drag_scale = drag_scale;
  return b;
}

// The propeller's section is not published; it is about 10 % thick. Nothing is fitted. XFOIL gives too little drag below Reynolds
// number 8e4, which is what the power errors show.
TEST_F(MeasuredPropeller, UnfittedStaticThrustWithin12PercentAndPowerWithin16Percent) {
  const Score s = compare(Rotor(measured_blade("naca4410", kSnelFactor)), "static", 0);
  record("static", s);
  EXPECT_GE(s.rows, 10);
  EXPECT_LT(s.thrust_rms, 0.12);
  EXPECT_LT(s.power_rms, 0.16);
}
TEST_F(MeasuredPropeller, UnfittedAdvanceSweepsWithin9PercentOfThrustAnd13PercentOfPower) {
  const Rotor rotor(measured_blade("naca4410", kSnelFactor));
  for (int rpm : {4031, 5039, 6045}) {
    const Score s = compare(rotor, "J_" + std::to_string(rpm) + "rpm", rpm);
    record("advance_" + std::to_string(rpm), s);
    EXPECT_GE(s.rows, 8);
    EXPECT_LT(s.thrust_rms, 0.09);
    EXPECT_LT(s.power_rms, 0.13);
  }
}
TEST_F(MeasuredPropeller, DragScaledBy1point3HalvesThePowerError) {
  const Blade plain = measured_blade("naca4410", kSnelFactor);
  for (const std::string name : {"static", "J_5039rpm"}) {
    const double rpm = name == "static" ? 0 : 5039;
    const Score s = compare(Rotor(scaled_drag(plain, 1.3)), name, rpm), unscaled = compare(Rotor(plain), name, rpm);
    record(name + "_drag_1.3", s);
    EXPECT_LT(s.power_rms, 0.7 * unscaled.power_rms) << name;
  }
}
// How much the unknown section matters: 12 % thick instead of 10 %, and stall delay left out.
TEST_F(MeasuredPropeller, AnotherSectionMovesThrustByUpTo15Percent) {
  const Rotor thick(measured_blade("naca4412", kSnelFactor));
  const Score s = compare(thick, "static", 0), sweep = compare(thick, "J_5039rpm", 5039);
  record("static_naca4412", s);
  record("advance_5039_naca4412", sweep);
  EXPECT_LT(s.thrust_rms, 0.05);
  EXPECT_LT(sweep.thrust_rms, 0.15);
}
TEST_F(MeasuredPropeller, StallDelayRaisesStaticThrustByThreeTo15PercentAndAdvanceSweepsByLess) {
  for (const std::string polar : {"naca4410", "naca4412"}) {
    const Rotor with(measured_blade(polar, kSnelFactor)), without(measured_blade(polar, 0.0));
    record("static_without_stall_delay_" + polar, compare(without, "static", 0));
    record("advance_5039_without_stall_delay_" + polar, compare(without, "J_5039rpm", 5039));
    const auto gain = [&](double climb) {
      const RotorCondition c = test::at(0, 0, climb, 5039 * test::kRpm);
      return test::solve_cold(with, c).force_R_N.z() / test::solve_cold(without, c).force_R_N.z() - 1;
    };
    EXPECT_GT(gain(0), 0.03) << polar;
    EXPECT_LT(gain(0), 0.15) << polar;
    EXPECT_LT(gain(0.4 * 5039 / 60 * 0.127), gain(0)) << polar;  // J = 0.4
  }
}

}  // namespace
}  // namespace rotorloop::sim
