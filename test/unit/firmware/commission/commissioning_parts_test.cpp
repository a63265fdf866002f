// The parts of the commissioning that only compute, each against its own specification.
#include <gtest/gtest.h>

#include "firmware/core/commission/plausible.hpp"
#include "firmware/core/commission/result.hpp"

namespace {

using namespace rotorloop::firmware;
using enum CommissioningEnd;

TEST(LeastSquares, FindsTheUnknownsOfRowsThatAreConsistentAndRefusesThoseThatDoNotTellThemApart) {
  LeastSquares<3> fit;
  for (int k = 1; k < 20; ++k) {
    const float x = 0.1f * static_cast<float>(k);
    fit.add({x, 1.0f, 1.0f / x}, 0.064f * x + 0.8f - 0.05f / x);
  }
  std::array<float, 3> u{};
  ASSERT_TRUE(fit.solve(u));
  EXPECT_NEAR(u[0], 0.064f, 1e-4f);
  EXPECT_NEAR(u[1], 0.8f, 1e-4f);
  EXPECT_NEAR(u[2], -0.05f, 1e-4f);
  LeastSquares<2> flat;
  for (int k = 0; k < 20; ++k) flat.add({2.0f, 1.0f}, 3.0f);
  std::array<float, 2> none{};
  EXPECT_FALSE(flat.solve(none));
}

TEST(DirectFit, TellsResistanceDeadTimeAndKneeApartAndTakesTheHeatBackToTheStart) {
  DirectFit f;
  f.largest_A = 12.0f;
  float heat_A2_s = 0.0f;
  for (std::uint32_t direction = 0; direction < kDirections; ++direction)
    for (const float share : kLevelShare) {
      const float i = share * 12.0f;
      heat_A2_s += 0.05f * i * i;
      const float ohm = 0.064f * (1.0f + 1.2e-4f * heat_A2_s);  // 1.7 % a second at 12 A
      add_window(f, direction, ohm * i + 4.0f / 3.0f * 0.6f - 2.0f * 0.6f * 0.05f / i, i, heat_A2_s);
    }
  expect_little_heat(f);
  const DirectResult r = solve(f);
  ASSERT_TRUE(r.valid);
  EXPECT_NEAR(r.resistance_ohm, 0.064f, 0.005f * 0.064f);
  EXPECT_NEAR(r.lost_V, 0.6f, 0.005f);
  EXPECT_NEAR(r.knee_A, 0.05f, 0.03f);
}

TEST(SpinFit, TellsInertiaFrictionAndLoadApartFromOneAccelerationAndOneCoasting) {
  SpinFit f;
  f.current_A = 10.0f;
  f.speed_rad_s = 1000.0f;
  const float J = 9.4e-6f, friction = 1.5e-3f, load = 2.9e-8f, flux = 3.4e-4f, torque_constant = 1.5f * 7.0f * flux, T = 1.0f / 24000.0f;
  float w = 300.0f, turned = 0.0f;
  for (int k = 0; k < 12000; ++k) {
    const bool coasting = k >= 6000;
    const float i = coasting ? 0.0f : 10.0f;
    w += T / J * (torque_constant * i - friction - load * w * w);
    integrate(f, i, w, T);
    turned += w;
    if (k % 96 == 95) {
      add_speed(f, turned / 96.0f);
      turned = 0.0f;
    }
    if (coasting) {
      f.emf_V[k % 2] += flux * 7.0f * w * T;
      f.emf_rad_s[k % 2] += 7.0f * w * T;
    }
  }
  const SpinResult r = solve(f, 7.0f);
  ASSERT_TRUE(r.valid);
  EXPECT_NEAR(r.flux_linkage_Wb, flux, 1e-3f * flux);
  EXPECT_NEAR(r.inertia_kg_m2, J, 0.01f * J);
  EXPECT_NEAR(r.friction_N_m, friction, 0.1f * friction);
  EXPECT_NEAR(r.load_N_m_s2, load, 0.02f * load);
}

PassResult pass(float ohm, float l_d, float l_q, float lost_V) { return {{ohm, lost_V, 0.05f, true}, l_d, l_q}; }

TEST(Plausible, NamesWhatIsWrongWithAResultAtRest) {
  const PassResult good = pass(0.064f, 14e-6f, 17e-6f, 0.6f);
  EXPECT_EQ(judge_standstill(good, good, 0.64f), none);
  EXPECT_EQ(judge_standstill(pass(0.0005f, 14e-6f, 17e-6f, 0.6f), good, 0.64f), resistance_range);
  EXPECT_EQ(judge_standstill(good, pass(0.064f, 14e-6f, 20e-3f, 0.6f), 0.64f), inductance_range);
  EXPECT_EQ(judge_standstill(pass(0.064f, 14e-6f, 40e-6f, 0.6f), good, 0.64f), inductance_ratio_range);
  EXPECT_EQ(judge_standstill(pass(0.064f, 14e-6f, 17e-6f, 1.4f), good, 0.64f), dead_time_range);
  EXPECT_EQ(judge_standstill(pass(0.068f, 14e-6f, 17e-6f, 0.6f), good, 0.64f), runs_differ_resistance);
  EXPECT_EQ(judge_standstill(good, pass(0.064f, 14e-6f, 18e-6f, 0.6f), 0.64f), runs_differ_inductance);
}

TEST(Plausible, NamesWhatIsWrongWithAResultOfTheSpinning) {
  const SpinResult good{3.42e-4f, 9.4e-6f, 1.5e-3f, 2.9e-8f, true};
  CommissioningOrder order;
  order.speed_constant_rpm_V = 2300.0f;
  order.bell_inertia_kg_m2 = 5e-6f;
  EXPECT_EQ(judge_spin(good, good, order, 7.0f), none);
  EXPECT_EQ(judge_spin(good, good, order, 6.0f), none);  // 14 %: K_v alone does not tell 6 from 7 pole pairs
  EXPECT_EQ(judge_spin(good, good, order, 5.0f), speed_constant_differs);
  EXPECT_EQ(judge_spin(good, good, order, 12.0f), speed_constant_differs);
  SpinResult other = good;
  other.flux_linkage_Wb = 3.65e-4f;
  EXPECT_EQ(judge_spin(good, other, order, 7.0f), runs_differ_flux);
  other = good;
  other.inertia_kg_m2 = 8.8e-6f;
  EXPECT_EQ(judge_spin(good, other, order, 7.0f), runs_differ_inertia);
  order.bell_inertia_kg_m2 = 1.1e-5f;
  EXPECT_EQ(judge_spin(good, good, order, 7.0f), inertia_below_bell);
  order.bell_inertia_kg_m2 = 9e-7f;
  EXPECT_EQ(judge_spin(good, good, order, 7.0f), inertia_far_above_bell);
}

TEST(Plausible, PolePairsComeFromACountedSpeedOrNotAtAll) {
  EXPECT_EQ(pole_pairs_of(3000.0f, 3000.0f / 7.0f * 1.03f), 7);
  EXPECT_EQ(pole_pairs_of(3000.0f, 3000.0f / 6.5f), 0);
  EXPECT_EQ(pole_pairs_of(3000.0f, 0.0f), 0);
}

TEST(CommissioningResult, BecomesParametersOnlyWhenItIsWhole) {
  CommissioningResult r;
  r.resistance_ohm = 0.068f;
  r.inductance_d_H = 14e-6f;
  r.inductance_q_H = 18e-6f;
  r.flux_linkage_Wb = 4e-4f;
  r.inertia_kg_m2 = 1e-5f;
  r.load_N_m_s2 = 3e-8f;
  r.pole_pairs = 6;
  r.standstill_valid = true;
  r.end = overcurrent;
  EXPECT_EQ(with_commissioning({}, r, 0.004f).resistance_ohm, Parameters{}.resistance_ohm);
  r.end = done;
  const Parameters rest = with_commissioning({}, r, 0.004f);
  EXPECT_NEAR(rest.resistance_ohm, 0.064f, 1e-6f);
  EXPECT_NEAR(rest.inductance_H, 16e-6f, 1e-9f);
  EXPECT_NEAR(rest.inductance_ratio, 18.0f / 14.0f, 1e-5f);
  EXPECT_EQ(rest.flux_linkage_Wb, Parameters{}.flux_linkage_Wb);  // not measured
  r.spin_valid = true;
  r.direction = SeenDirection::reversed;
  const Parameters all = with_commissioning({}, r, 0.004f);
  EXPECT_EQ(all.flux_linkage_Wb, 4e-4f);
  EXPECT_EQ(all.pole_pairs, 6);
  EXPECT_TRUE(all.dir_reversed);
}

TEST(CommissioningResult, LossOfALegIsOddGrowsWithCurrentAndEndsAtTheDeadTime) {
  CommissioningResult r;
  r.dead_time_s = 800e-9f;
  r.dead_time_knee_A = 0.05f;
  const auto loss_V = [&](float i) { return bridge_loss_V(r, 48000.0f, 0.8f, 15.0f, i); };
  EXPECT_NEAR(loss_V(20.0f), 0.637f, 0.003f);
  EXPECT_EQ(loss_V(0.0f), 0.0f);
  for (float i = 0.01f; i < 20.0f; i *= 1.1f) {
    EXPECT_EQ(loss_V(-i), -loss_V(i));
    EXPECT_GT(loss_V(1.1f * i), loss_V(i));
  }
}

}  // namespace
