// The averaged laws of the bridge (commutation.hpp) judged by the bridge that steps every edge.
#include "sim/drive/switched_bridge.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "sim/drive/commutation.hpp"

namespace {

using namespace rotorloop::sim;

constexpr double kPwm_Hz = 48000.0, kBus_V = 15.0;

struct Point {
  double amplitude_A, direction_rad, voltage_V, lead_rad, dead_s, node_F;
};

// Winding of the reference motor on a shaft that no torque moves; the EMF takes what the voltage is more than R i.
struct Bench {
  SwitchedStage stage;
  MotorConstants<double> motor{};
  MotorState state{};
  std::array<double, 3> duty{};
};

Bench bench(const Point& p) {
  Bench b;
  b.stage.inverter.pwm_Hz = kPwm_Hz;
  b.stage.inverter.dead_time_s = p.dead_s;
  b.stage.inverter.node_capacitance_F = p.node_F;
  b.stage.inverter.switch_resistance_ohm = 0.0;  // the averaged law is in front of it
  b.stage.bus_V = kBus_V;
  // The rotor's q axis on the voltage: EMF = w_e flux along q. So slow that it turns 1e-3 rad in the period.
  const double voltage_rad = p.direction_rad + p.lead_rad, rotor_rad = voltage_rad - 0.5 * std::numbers::pi, w_e = 50.0;
  b.motor = {.pole_pairs = 1.0,
             .resistance_ohm = 0.0,
             .inductance_d_H = 15e-6,
             .inductance_q_H = 15e-6,
             .flux_linkage_Wb = p.voltage_V / w_e,
             .inertia_kg_m2 = 1e9,
             .static_friction_N_m = 0.0,
             .cogging_N_m = 0.0};
  b.state.omega_rad_s = w_e;
  b.state.cos_e = std::cos(rotor_rad);
  b.state.sin_e = std::sin(rotor_rad);
  b.state.i_d_A = p.amplitude_A * std::cos(p.direction_rad - rotor_rad);
  b.state.i_q_A = p.amplitude_A * std::sin(p.direction_rad - rotor_rad);
  for (std::size_t k = 0; k < 3; ++k)
    b.duty[k] = 0.5 + p.voltage_V / kBus_V * std::cos(voltage_rad - 2.0 * std::numbers::pi / 3.0 * static_cast<double>(k));
  return b;
}

CommutationConstants<double> averaged(const Point& p, const Bench& b) {
  auto c = commutation_constants(p.dead_s, kPwm_Hz, b.stage.inverter.diode_drop_V, kBus_V, p.node_F, 15e-6);
  set_ripple(c, b.duty, to_phases(stator_current_A(b.state)), kBus_V / kPwm_Hz / 15e-6);
  return c;
}

PhaseCurrents phases(const MotorState& s) { return to_phases(stator_current_A(s)); }

// As a current control does: the duties are corrected until the period ends with the current that it began with.
SwitchedPeriod steady_period(Bench& b) {
  for (int pass = 0;; ++pass) {
    Bench once = b;
    const SwitchedPeriod p = SwitchedBridge{}.step_period(once.stage, once.motor, once.state, once.duty, kAllGates, {});
    const Vector2 before = stator_current_A(b.state), after = stator_current_A(once.state);
    if (pass == 12) return p;
    const double per_A = 0.7 * 15e-6 * kPwm_Hz / kBus_V;  // duty
    const PhaseCurrents off = to_phases(Vector2{after.alpha - before.alpha, after.beta - before.beta});
    b.duty[0] -= per_A * off.u;
    b.duty[1] -= per_A * off.v;
    b.duty[2] -= per_A * off.w;
  }
}

struct Deviation {
  double worst_V = 0.0, rms_V = 0.0, largest_V = 0.0;
};

// Over currents, directions, voltages, dead times and capacitances.
Deviation deviation(const std::vector<double>& amplitudes_A, bool simple_law = false) {
  Deviation d;
  double sum2 = 0.0;
  int count = 0;
  for (const double dead_s : {500e-9, 800e-9, 1100e-9})
    for (const double node_F : {2e-9, 6e-9})
      for (const double amplitude_A : amplitudes_A)
        for (const double voltage_V : {0.0, 0.5, 2.0, 5.0})
          for (int n = 0; n < 12; ++n) {
            const Point p{amplitude_A, 0.1 + n * std::numbers::pi / 6.0, voltage_V, 0.3, dead_s, node_F};
            Bench b = bench(p);
            const SwitchedPeriod truth = steady_period(b);
            const Vector2 v = simple_law ? bridge_output(bridge_constants(b.stage.inverter, kBus_V), b.duty, phases(b.state)).v_V
                                         : commutated_output(averaged(p, b), b.duty, phases(b.state)).v_V;
            const Vector2 asked{(2.0 * b.duty[0] - b.duty[1] - b.duty[2]) / 3.0 * kBus_V,
                                (b.duty[1] - b.duty[2]) / std::sqrt(3.0) * kBus_V};
            const double off_V = std::hypot(v.alpha - truth.mean_v_V.alpha, v.beta - truth.mean_v_V.beta);
            d.largest_V = std::max(d.largest_V, std::hypot(asked.alpha - truth.mean_v_V.alpha, asked.beta - truth.mean_v_V.beta));
            d.worst_V = std::max(d.worst_V, off_V);
            sum2 += off_V * off_V;
            ++count;
          }
  d.rms_V = std::sqrt(sum2 / count);
  return d;
}

// Bounds as shares of what the longest dead time takes from a large current: 4/3 · 1.1 us · 48 kHz · 16.6 V = 1.17 V.
constexpr double kMost_V = 1.17;

void report(const char* range, const Deviation& d) {
  std::printf("[ measured ] %s: averaged law off by %.0f mV rms, %.0f mV at most, of %.0f mV\n", range, 1e3 * d.rms_V, 1e3 * d.worst_V,
              1e3 * d.largest_V);
}

TEST(SwitchedBridge, AveragedDeadTimeErrorWithin3PercentOfTheLargestFrom12To40Amperes) {
  const Deviation d = deviation({12.0, 20.0, 40.0});
  report("12 to 40 A", d);
  EXPECT_LT(d.worst_V, 0.03 * kMost_V);
  EXPECT_GT(d.largest_V, 0.9);
}

TEST(SwitchedBridge, AveragedDeadTimeErrorWithin4PercentRmsAnd30PercentAtMostAt4To8Amperes) {
  const Deviation d = deviation({4.0, 6.0, 8.0});
  report("4 to 8 A", d);
  EXPECT_LT(d.rms_V, 0.04 * kMost_V);
  EXPECT_LT(d.worst_V, 0.30 * kMost_V);  // a phase that is below an ampere at one edge
}

// At 2 A and less some phase is always within the reach of the dead time's own current. The law follows the edges there by
// three quarters; a sign with a zone of 1.5 A, as the simple law, does not by more.
TEST(SwitchedBridge, AveragedDeadTimeErrorWithin25PercentRmsUpTo2AmperesAndCloserThanTheSimpleLaw) {
  const Deviation d = deviation({0.05, 0.2, 0.5, 1.0, 2.0}), simple = deviation({0.05, 0.2, 0.5, 1.0, 2.0}, true);
  report("up to 2 A", d);
  report("up to 2 A, simple law", simple);
  EXPECT_LT(d.rms_V, 0.25 * kMost_V);
  EXPECT_LT(d.rms_V, simple.rms_V);
}

TEST(SwitchedBridge, RippleAtTheEdgesIsTheClosedFormOfTheThreeDuties) {
  for (const double voltage_V : {1.0, 3.0, 5.0, 7.0})
    for (int n = 0; n < 12; ++n) {
      const Point p{25.0, 0.2 + n * std::numbers::pi / 6.0, voltage_V, 0.4, 1e-9, 0.5e-9};  // hardly any dead time
      Bench b = bench(p);
      const std::array<double, 3> half = half_ripple_A(b.duty, kBus_V / kPwm_Hz / 15e-6);
      const SwitchedPeriod truth = SwitchedBridge{}.step_period(b.stage, b.motor, b.state, b.duty, kAllGates, {});
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(truth.fall_A[k] - truth.rise_A[k], 2.0 * half[k], 0.02 * std::fabs(2.0 * half[k]) + 0.03) << voltage_V << " V, " << n;
    }
}

TEST(SwitchedBridge, EnergyFromTheBusIsMotionDiodesAndNothingElseAt20Amperes) {
  const Point p{20.0, 0.1, 5.0, 0.0, 800e-9, 2e-9};
  Bench b = bench(p);
  const double w = b.state.omega_rad_s;
  const double stored_J = 0.75 * 15e-6 * (b.state.i_d_A * b.state.i_d_A + b.state.i_q_A * b.state.i_q_A);
  SwitchedPeriod truth = SwitchedBridge{}.step_period(b.stage, b.motor, b.state, b.duty, kAllGates, {});
  const double after_J = 0.75 * 15e-6 * (b.state.i_d_A * b.state.i_d_A + b.state.i_q_A * b.state.i_q_A);
  const double shaft_J = torque_N_m(b.motor, b.state.i_d_A, b.state.i_q_A) * w / kPwm_Hz;
  const PhaseCurrents i = phases(b.state);
  const double diodes_J = 2.0 * 800e-9 * 0.8 * (std::fabs(i.u) + std::fabs(i.v) + std::fabs(i.w));
  EXPECT_NEAR(truth.bus_J, shaft_J + diodes_J + after_J - stored_J, 0.03 * truth.bus_J);
}

TEST(SwitchedBridge, GatesOffLetTheDiodesEmptyTheWindingIntoTheSupply) {
  Point p{20.0, 0.1, 0.0, 0.0, 800e-9, 2e-9};
  Bench b = bench(p);
  const double stored_J = 0.75 * 15e-6 * 400.0;
  SwitchedBridge bridge;
  double returned_J = 0.0;
  for (int k = 0; k < 4; ++k) returned_J -= bridge.step_period(b.stage, b.motor, b.state, {0.5, 0.5, 0.5}, kNoGates, {}).bus_J;
  EXPECT_LT(std::hypot(b.state.i_d_A, b.state.i_q_A), 0.3);  // what winding and nodes swing with
  EXPECT_NEAR(returned_J, stored_J, 0.15 * stored_J);        // less what the diodes burn, 0.8 of 15 V twice
}

// A rotor that turns freely, no resistance and no diode drop: what the bus takes back is what the rotor loses, whatever is switched. Hard
// edges burn the charge of a node at most, C U² each.
struct Balance {
  double rotor_J = 0.0, bus_J = 0.0, most_node_J = 0.0;
  double off() const { return std::max(0.0, std::fabs(rotor_J - bus_J) - most_node_J) / std::fabs(rotor_J); }
};
Balance balance(double inductance_H, double node_F, double longest_step_s, std::uint8_t gates, double duty, double i_d_A) {
  constexpr double kInertia_kg_m2 = 1e-6, kPeriods = 480;
  Bench b;
  b.stage.inverter.pwm_Hz = kPwm_Hz;
  b.stage.inverter.dead_time_s = 800e-9;
  b.stage.inverter.node_capacitance_F = node_F;
  b.stage.inverter.switch_resistance_ohm = 0.0;
  b.stage.inverter.diode_drop_V = 0.0;
  b.stage.bus_V = 24.0;
  b.stage.longest_step_s = longest_step_s;
  b.motor = {.pole_pairs = 7.0,
             .resistance_ohm = 0.0,
             .inductance_d_H = inductance_H,
             .inductance_q_H = inductance_H,
             .flux_linkage_Wb = 4.4e-4,
             .inertia_kg_m2 = kInertia_kg_m2,
             .static_friction_N_m = 0.0,
             .cogging_N_m = 0.0};
  b.state.omega_rad_s = 1000.0;
  b.state.cos_e = 1.0;
  b.state.i_d_A = i_d_A;
  const auto stored_J = [&] {
    return 0.5 * kInertia_kg_m2 * b.state.omega_rad_s * b.state.omega_rad_s +
           0.75 * inductance_H * (b.state.i_d_A * b.state.i_d_A + b.state.i_q_A * b.state.i_q_A);
  };
  const double before_J = stored_J();
  Balance e;
  SwitchedBridge bridge;
  for (int k = 0; k < kPeriods; ++k) e.bus_J -= bridge.step_period(b.stage, b.motor, b.state, {duty, duty, duty}, gates, {}).bus_J;
  e.rotor_J = before_J - stored_J();
  e.most_node_J = gates == kNoGates ? 0.0 : 6.0 * kPeriods * node_F * 24.0 * 24.0;
  return e;
}
constexpr std::uint8_t kLowGates = 0x38;

TEST(SwitchedBridge, LowSidePulsesReturnWhatTheRotorLosesWithin1PercentAt3To15Microhenry) {
  for (const double inductance_H : {3e-6, 5.9e-6, 15e-6})
    for (const double node_F : {0.5e-9, 2e-9})
      for (const double step_s : {0.25e-6, 0.5e-6}) {
        const Balance e = balance(inductance_H, node_F, step_s, kLowGates, 0.7, 0.0);
        std::printf("[ measured ] %.1f uH, %.1f nF, %.2f us: rotor gave %.2f mJ, the bus took %.2f mJ\n", 1e6 * inductance_H, 1e9 * node_F,
                    1e6 * step_s, 1e3 * e.rotor_J, 1e3 * e.bus_J);
        EXPECT_GT(e.rotor_J, 1e-3);
        EXPECT_LT(e.off(), 0.01);
      }
}

TEST(SwitchedBridge, AnOpenBridgeTakesNothingFromARotorThatInducesLessThanTheBus) {
  for (const double inductance_H : {3e-6, 5.9e-6, 15e-6})
    for (const double node_F : {0.5e-9, 2e-9})
      for (const double step_s : {0.25e-6, 0.5e-6}) {
        const double stored_J = 0.75 * inductance_H * 3.0 * 3.0;
        const Balance e = balance(inductance_H, node_F, step_s, kNoGates, 0.5, 3.0);
        EXPECT_NEAR(e.bus_J, stored_J, 0.1 * stored_J) << 1e6 * inductance_H << " uH, " << 1e9 * node_F << " nF";
        EXPECT_NEAR(e.rotor_J, e.bus_J, 0.05 * stored_J) << 1e6 * inductance_H << " uH, " << 1e9 * node_F << " nF";
      }
}

}  // namespace
