// The bus that four ESCs share, against the circuit's closed forms.
#include "sim/drive/supply.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace {

using namespace rotorloop::sim;

constexpr double kSample_s = 1.0 / 24000.0;

BatteryParameters stiff() {
  BatteryParameters b;
  b.capacity_A_s = 1e9;
  b.relaxation_ohm = 0.0;
  return b;
}

TEST(Supply, SettlesAtTheBatterysResistanceTimesTheSumOfTheFourCurrents) {
  Supply s(stiff(), {});
  const double rest_V = s.voltage_V();
  for (int k = 0; k < 2400; ++k) s.step(std::array{5.0, 6.0, 7.0, 2.0}, kSample_s);
  EXPECT_NEAR(rest_V - s.voltage_V(), 20.0 * 0.030, 1e-3);
  EXPECT_NEAR(s.cable_A(), 20.0, 1e-3);
}

TEST(Supply, StepOfCurrentComesFromTheCapacitorsUntilTheLeadsHaveTakenItOver) {
  CableParameters cable;
  cable.inductance_H = 30e-6;  // a metre and a half each way: 0.6 kHz, far below the sampling
  Supply s(stiff(), cable);
  const double rest_V = s.voltage_V();
  double lowest_V = rest_V;
  for (int k = 0; k < 240; ++k) lowest_V = std::min(lowest_V, s.step(std::array{30.0, 0.0, 0.0, 0.0}, kSample_s));
  // Series resonance with sum of resistances r = 36 mohm: sag = I R + overshoot; at most I sqrt(L/C) beyond the rest.
  const double wave_ohm = std::sqrt(30e-6 / cable.capacitance_F);
  EXPECT_GT(rest_V - lowest_V, 30.0 * 0.030 * 1.3);
  EXPECT_LT(rest_V - lowest_V, 30.0 * (0.030 + wave_ohm));
}

TEST(Supply, OneEscsBrakingRaisesTheVoltageOfAllAndABenchSupplyDoesNotTakeItBack) {
  BatteryParameters b = stiff();
  b.can_sink = false;
  Supply s(b, {});
  const double rest_V = s.voltage_V();
  for (int k = 0; k < 240; ++k) s.step(std::array{-2.0, 0.0, 0.0, 0.0}, kSample_s);
  EXPECT_NEAR(s.voltage_V() - rest_V, 2.0 * 0.01 / (4 * 470e-6), 0.3);
}

TEST(Supply, RippleOfEqualEscsAddsInPhaseAndCancelsInQuadratureOfTheirPwm) {
  const Supply s(stiff(), {});
  const std::array<double, 4> each = {10.0, 10.0, 10.0, 10.0};
  const double together_V = s.ripple_V(0, each, std::array{0.0, 0.0, 0.0, 0.0}, 48000.0);
  EXPECT_GT(together_V, 0.2);
  EXPECT_NEAR(s.ripple_V(0, each, std::array{0.0, 0.25, 0.0, 0.25}, 48000.0), 0.0, 1e-12);
  EXPECT_NEAR(s.ripple_V(0, each, std::array{0.0, 0.5, 0.0, 0.5}, 48000.0), together_V, 1e-12);  // two pulses per period
}

}  // namespace
