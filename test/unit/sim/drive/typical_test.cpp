// Drawn boards: the spread that is promised, and physics that a drawn drive still obeys.
#include "sim/drive/typical.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "sim/drive/boards.hpp"

namespace {

using namespace rotorloop::sim;
using rotorloop::RandomStream;

constexpr double kSampling_s = 1.0 / 48000.0;

struct Range {
  double least = 1e300, most = -1e300;
  void add(double x) {
    least = std::min(least, x);
    most = std::max(most, x);
  }
};

TEST(TypicalBoard, DrawsFillTheStatedRangesAndKeepTheMeanInductance) {
  Range dead_ns, saliency, drift, reference, divider, ppm, phase;
  const DriveParameters nominal;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    const TypicalDrive t = typical_drive(nominal, 45.0, RandomStream(seed, 1));
    dead_ns.add(1e9 * t.drive.inverter.dead_time_s);
    saliency.add(t.drive.motor.inductance_H.q / t.drive.motor.inductance_H.d);
    EXPECT_NEAR(0.5 * (t.drive.motor.inductance_H.d + t.drive.motor.inductance_H.q), 15e-6, 1e-12);
    for (const double d : t.drive.sensing.drift_counts) drift.add(d);
    reference.add(t.drive.sensing.reference_V / 3.3);
    divider.add(t.drive.sensing.bus_ratio / 0.09626);
    ppm.add(t.clock_ppm);
    phase.add(t.pwm_phase);
  }
  const auto fills = [](const Range& r, double low, double high) {
    const double tenth = 0.1 * (high - low);
    EXPECT_GE(r.least, low);
    EXPECT_LT(r.least, low + tenth);
    EXPECT_LE(r.most, high);
    EXPECT_GT(r.most, high - tenth);
  };
  fills(dead_ns, 500.0, 1100.0);
  fills(saliency, 1.0, 1.4);
  fills(drift, -20.0, 20.0);
  fills(reference, 0.99, 1.01);
  fills(divider, 0.99, 1.01);
  fills(ppm, -50.0, 50.0);
  fills(phase, 0.0, 1.0);
}

TEST(TypicalBoard, EnergyFromTheBusIsCopperMotionFrictionDiodesAndTheSaturatedField) {
  DriveParameters p = typical_drive({}, 45.0, RandomStream(5, 1)).drive;
  p.motor.cogging_N_m = 0.0;
  p.thermal.follows = false;
  Drive drive(p, RandomStream(1, 1));
  drive.set_bus_V(15.0);
  double lost_J = 0.0;
  const PwmCommand pwm{{1000, 850, 800}, 1771, true};
  for (int k = 0; k < 2000; ++k) {
    drive.step(pwm);
    const auto& s = drive.motor().state();
    const PhaseCurrents i = drive.phase_currents_A();
    const double diodes_W = 2.0 * p.inverter.dead_time_s * 48000.0 * 0.8 * (std::fabs(i.u) + std::fabs(i.v) + std::fabs(i.w));
    lost_J += (1.5 * 0.064 * (s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A) + 2e-3 * std::fabs(s.omega_rad_s) + diodes_W) * kSampling_s;
  }
  const double balance_J = lost_J + drive.motor().kinetic_energy_J() + drive.motor().magnetic_energy_J();
  EXPECT_NEAR(drive.bus_energy_J(), balance_J, 0.02 * balance_J);
}

TEST(TypicalBoard, OffsetsRampToTheirDriftAndStayThere) {
  DriveParameters p;
  p.sensing.noise_counts = 0.0;
  p.sensing.drift_counts = {20.0, -10.0, 0.0};
  p.sensing.drift_s = 0.2;
  Drive drive(p, RandomStream(1, 1));
  const auto offset_after = [&](int ms) {
    for (int k = 0; k < 48 * ms; ++k) drive.step({});
    return drive.sample().phase[0] - 2553;
  };
  EXPECT_NEAR(offset_after(100), 10, 1.5);
  EXPECT_NEAR(offset_after(110), 20, 1);
  EXPECT_NEAR(offset_after(300), 20, 1);
}

TEST(TypicalBoard, OneConversionInTheStatedNumberIsNonsenseOnEveryChannelInTurn) {
  SensingParameters p;
  p.bad_sample_every = 1000.0;
  Sensing sensing(p, RandomStream(3, 3));
  int bad = 0, doubles = 0, last = -10;
  std::set<int> channels;
  for (int n = 0; n < 400000; ++n) {
    const AdcReading r = sensing.sample({}, {1e-5, 1e-5, 1e-5}, 15.0, 298.15);
    const std::array<int, 5> far = {std::abs(r.phase[0] - 2553), std::abs(r.phase[1] - 2553), std::abs(r.phase[2] - 2553),
                                    std::abs(r.bus - 1792), std::abs(r.temperature - 1738)};
    for (int c = 0; c < 5; ++c)
      if (far[static_cast<std::size_t>(c)] > 40) {
        ++bad;
        channels.insert(c);
        if (n - last == 1) ++doubles;
        last = n;
      }
  }
  EXPECT_NEAR(bad, 400, 70);  // 3.5 standard deviations of a Poisson number
  EXPECT_EQ(channels.size(), 5u);
  EXPECT_LE(doubles, 4);
}

TEST(Thermal, WindingOfAHeldRotorAtAConstantVoltageHeatsAtItsLossOverItsHeatCapacityAndItsResistanceFollows) {
  DriveParameters p = typical_drive({}, 45.0, RandomStream(5, 1)).drive;
  p.faults = {{.kind = DriveFaultKind::rotor_lock}};
  Drive drive(p, RandomStream(1, 1));
  drive.set_bus_V(15.0);
  PwmCommand pwm{{1100, 856, 856}, 1771, true};
  for (int k = 0; k < 480; ++k) drive.step(pwm);
  const double t0 = drive.temperatures().winding_K;
  double loss_J = 0.0;
  for (int k = 0; k < 4800; ++k) {
    drive.step(pwm);
    const auto& s = drive.motor().state();
    loss_J += 1.5 * 0.06 * copper_factor(drive.temperatures().winding_K) * (s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A) * kSampling_s;
  }
  ASSERT_GT(loss_J, 0.2);
  EXPECT_NEAR(drive.temperatures().winding_K - t0, loss_J / p.thermal.winding_J_K, 0.08 * loss_J / p.thermal.winding_J_K);
  EXPECT_EQ(drive.omega_rad_s(), 0.0);
  EXPECT_GT(drive.temperatures().fets_K, drive.temperatures().board_K);
}

TEST(BoardStages, HoldTheStatedScales) {
  ASSERT_EQ(board_stages().size(), 3u);
  for (const BoardStage& b : board_stages()) {
    const SensingParameters& s = b.sensing;
    EXPECT_NEAR(3.3 / s.bus_ratio, b.most_bus_V, 0.01 * b.most_bus_V) << b.name;
    const double room_V = std::min(s.current_zero_V, 3.3 - s.current_zero_V);
    EXPECT_GE(room_V / std::fabs(s.current_V_per_A), b.most_phase_A) << b.name;
    EXPECT_LE(4.25 * b.most_cells, b.most_bus_V) << b.name;
  }
  EXPECT_EQ(find_board_stage("b_g431b_esc"), nullptr);
}

}  // namespace
