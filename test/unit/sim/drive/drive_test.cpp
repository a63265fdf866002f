// The plant against physics that it does not compute itself: energy, closed-form circuits, symmetry, limits.
#include "sim/drive/drive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "sim/drive/battery.hpp"

namespace {

using namespace rotorloop::sim;

constexpr double kPwm_s = 1.0 / 48000.0;

MotorParameters frictionless() {
  MotorParameters m;
  m.static_friction_N_m = 0.0;
  m.cogging_N_m = 0.0;
  return m;
}

TEST(Motor, ElectricalEnergyIsCopperPlusMotionPlusLoadPlusStored) {
  for (const double lq : {15e-6, 22e-6}) {  // round and salient
    MotorParameters p = frictionless();
    p.inductance_H.q = lq;
    Motor motor(p, 9.4e-6, 0.3);
    const ShaftLoad load{2.9e-8, 0.0};
    double in_J = 0.0, copper_J = 0.0, load_J = 0.0;
    double angle = 0.0, w = 0.0;
    for (int k = 0; k < 48000; ++k) {
      // A voltage vector that turns ahead of the rotor and speeds up, with steps in it.
      w = std::min(8000.0, w + 8000.0 * kPwm_s * 1.2);
      angle += w * kPwm_s;
      const double v = 0.6 + 3.42e-4 * w * 1.1 + (k % 4800 < 2400 ? 0.2 : 0.0);
      const MotorState a = motor.state();
      in_J += motor.step_driven({v * std::cos(angle), v * std::sin(angle)}, 4e-3, load, kPwm_s);
      const MotorState b = motor.state();
      const auto loss = [](const MotorState& s) { return 1.5 * 0.064 * (s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A); };

      copper_J += 0.5 * (loss(a) + loss(b)) * kPwm_s;
      const auto drag = [](const MotorState& s) { return 2.9e-8 * s.omega_rad_s * s.omega_rad_s * std::fabs(s.omega_rad_s); };
      load_J += 0.5 * (drag(a) + drag(b)) * kPwm_s;
    }
    const double out_J = copper_J + load_J + motor.kinetic_energy_J() + motor.magnetic_energy_J();
    EXPECT_GT(in_J, 1.0);
    EXPECT_NEAR(out_J, in_J, 5e-3 * in_J);
  }
}

TEST(Motor, LockedRotorStepFollowsTheClosedFormOfAnRLCircuit) {
  Motor motor(frictionless(), 1e9);  // too heavy to move
  const double v = 1.0, r = 0.06, l = 15e-6;
  for (int k = 1; k <= 100; ++k) {
    motor.step_driven({v, 0.0}, 0.0, {}, kPwm_s);
    EXPECT_NEAR(motor.state().i_d_A, v / r * (1.0 - std::exp(-r / l * k * kPwm_s)), 1e-5) << k;
  }
}

// What an ESC without voltage dividers could feel of a shaft that is turned by hand: windings shorted at the low side, current through
// the shunts. A hand holds the speed; a rotor that is only set going is stopped by that same current before it has turned far.
TEST(Motor, ShortedWindingsCarryTheBackEmfOverTheImpedanceWhereTheShaftIsHeldAndStopAFreeRotorWithinFourTimeConstants) {
  constexpr double kSwitch_ohm = 4e-3;
  for (const double speed_rad_s : {-60.0, -20.0, 5.0, 20.0, 25.0, 60.0}) {
    Motor held(frictionless(), 1e9);
    held.state().omega_rad_s = speed_rad_s;
    const MotorParameters& p = held.parameters();
    const double w_e = p.pole_pairs * speed_rad_s, resistance_ohm = p.resistance_ohm + kSwitch_ohm;
    const double expected_A = std::fabs(w_e) * p.flux_linkage_Wb / std::hypot(resistance_ohm, w_e * p.inductance_H.q);
    double most_A = 0.0, squares_A2 = 0.0;
    for (int k = 0; k < 48000; ++k) {
      held.step_driven({0.0, 0.0}, kSwitch_ohm, {}, kPwm_s);
      const double phase_A = held.current_A().alpha;
      most_A = std::max(most_A, std::fabs(phase_A));
      squares_A2 += phase_A * phase_A / 48000.0;
    }
    EXPECT_NEAR(most_A, expected_A, 0.01 * expected_A) << speed_rad_s;
    RecordProperty("held_at_" + std::to_string(static_cast<int>(speed_rad_s)) + "_rad_s_peak_A", std::to_string(most_A));

    Motor free(MotorParameters{}, 9.4e-6);
    free.state().omega_rad_s = speed_rad_s;
    double free_squares_A2 = 0.0, stopped_s = 0.0;
    for (int k = 0; k < 48000; ++k) {
      free.step_driven({0.0, 0.0}, kSwitch_ohm, {}, kPwm_s);
      free_squares_A2 += free.current_A().alpha * free.current_A().alpha / 48000.0;
      if (std::fabs(free.state().omega_rad_s) > 0.02 * std::fabs(speed_rad_s)) stopped_s = k * kPwm_s;
    }
    const double flux_Wb = p.pole_pairs * p.flux_linkage_Wb;
    EXPECT_LE(stopped_s, 4.0 * 9.4e-6 * resistance_ohm / (1.5 * flux_Wb * flux_Wb)) << speed_rad_s;  // exp(-4) is below 2 %
    EXPECT_LE(free_squares_A2, 0.1 * squares_A2) << speed_rad_s;
    RecordProperty("free_from_" + std::to_string(static_cast<int>(speed_rad_s)) + "_rad_s",
                   std::to_string(stopped_s) + " s, rms over 1 s " + std::to_string(std::sqrt(free_squares_A2)) + " A, held " +
                       std::to_string(std::sqrt(squares_A2)) + " A");
  }
}

TEST(Motor, HeldStatorVoltageAt200ThousandElectricalRpmAgreesWithTheExactSolution) {
  // Round rotor at constant speed: in the stator frame L di/dt = v - R i - j w flux e^{jwt} has an exact one-step solution.
  using C = std::complex<double>;
  const double w_e = 200e3 / 60.0 * 2.0 * std::numbers::pi, r = 0.06, l = 15e-6, flux = 3.42e-4;
  MotorParameters p = frictionless();
  Motor motor(p, 1e9, 0.0);
  motor.state().omega_rad_s = w_e / p.pole_pairs;
  C i = 0.0;
  const C j(0.0, 1.0);
  const double decay = std::exp(-r / l * kPwm_s);
  for (int k = 0; k < 2000; ++k) {
    const double theta = w_e * k * kPwm_s;
    const C v = 7.6 * std::exp(j * (theta + 1.6));
    // Particular solution of the back-EMF: -j w flux e^{jwt} / (R + j w L).
    const C part0 = -j * w_e * flux * std::exp(j * theta) / (r + j * w_e * l);
    const C part1 = -j * w_e * flux * std::exp(j * (theta + w_e * kPwm_s)) / (r + j * w_e * l);
    i = decay * (i - part0 - v / r) + part1 + v / r;
    motor.step_driven({v.real(), v.imag()}, 0.0, {}, kPwm_s);
  }
  const Vector2 got = motor.current_A();
  EXPECT_NEAR(got.alpha, i.real(), 0.01 * std::abs(i));
  EXPECT_NEAR(got.beta, i.imag(), 0.01 * std::abs(i));
  EXPECT_NEAR(motor.state().cos_e * motor.state().cos_e + motor.state().sin_e * motor.state().sin_e, 1.0, 1e-12);
}

TEST(Motor, FluxOfTheReferenceDriveGives2300RpmPerVolt) {
  // Unloaded, driven by the line-to-line peak voltage: speed/volt is the motor's Kv.
  const MotorParameters p;
  const double w_per_V = 1.0 / (std::sqrt(3.0) * p.flux_linkage_Wb * p.pole_pairs);
  EXPECT_NEAR(w_per_V * 60.0 / (2.0 * std::numbers::pi), 2300.0, 5.0);
}

TEST(Motor, CoastsDownByItsLoadAsTheClosedFormSays) {
  Motor motor(frictionless(), 9.4e-6);
  motor.state().omega_rad_s = 1500.0;
  for (int k = 0; k < 48000; ++k) motor.step_open(15.0, {2.9e-8, 0.0}, kPwm_s);
  EXPECT_NEAR(motor.state().omega_rad_s, 1500.0 / (1.0 + 1500.0 * 2.9e-8 / 9.4e-6), 0.05);
}

TEST(Motor, OpenBridgeReturnsTheWindingsEnergyAndStopsTheCurrent) {
  Motor motor(frictionless(), 1e9);
  motor.state().i_q_A = 30.0;
  const double stored_J = motor.magnetic_energy_J();
  double taken_J = 0.0;
  for (int k = 0; k < 10; ++k) taken_J += motor.step_open(15.0, {}, kPwm_s);
  EXPECT_DOUBLE_EQ(motor.state().i_q_A, 0.0);
  EXPECT_NEAR(-taken_J, stored_J, 1e-12);
}

TEST(Motor, CoggingAveragesToZeroOverATurnAndRepeats84Times) {
  const MotorParameters p;
  Motor motor(p, 1e-5);
  double sum = 0.0, most = 0.0;
  int sign_changes = 0;
  double last = 0.0;
  for (int k = 0; k < 8400; ++k) {
    motor.set_angle(2.0 * std::numbers::pi * (k + 0.5) / 8400);
    const double t = motor.cogging_N_m();
    sum += t;
    most = std::max(most, std::fabs(t));
    if (t * last < 0.0) ++sign_changes;
    last = t;
  }
  EXPECT_NEAR(sum / 8400, 0.0, 1e-9);
  EXPECT_NEAR(most, 1e-3, 1e-5);
  EXPECT_NEAR(sign_changes, 168, 1);
}

TEST(Inverter, ALegThatStaysOnOneSideLosesNothingSoShortedWindingsBrakeWithAllThatTheyInduce) {
  InverterParameters p;
  p.dead_time_s = 800e-9;
  for (const double duty : {0.0, 1.0}) {
    const BridgeOutput out = bridge_output(bridge_constants(p, 15.0), {duty, duty, duty}, {5.0, -2.0, -3.0});
    EXPECT_EQ(out.v_V.alpha, 0.0);
    EXPECT_EQ(out.v_V.beta, 0.0);
  }
  // One leg that switches loses its own share and no other's: 2/3 of 0.64 V along it.
  const BridgeOutput one = bridge_output(bridge_constants(p, 15.0), {0.5, 0.0, 0.0}, {5.0, -2.5, -2.5});
  EXPECT_NEAR(one.v_V.alpha, 2.0 / 3.0 * (7.5 - 800e-9 * p.pwm_Hz * (15.0 + 2.0 * p.diode_drop_V)), 1e-12);
}

TEST(Inverter, DeadTimeTakesVoltageAgainstTheSignOfTheCurrentAndVanishesAtZero) {
  const InverterParameters p;
  const auto u_V = [&](double i) { return bridge_output(bridge_constants(p, 15.0), {0.6, 0.5, 0.5}, {i, -0.5 * i, -0.5 * i}).v_V.alpha; };
  const double ideal = 2.0 / 3.0 * 0.1 * 15.0;
  EXPECT_NEAR(u_V(0.0), ideal, 1e-12);
  EXPECT_LT(u_V(20.0), ideal);
  EXPECT_NEAR(u_V(20.0) + u_V(-20.0), 2.0 * ideal, 1e-12);
  EXPECT_NEAR(ideal - u_V(20.0), 4.0 / 3.0 * 800e-9 * 48000.0 * (15.0 + 1.6), 1e-9);  // 0.85 V: three times the back-EMF at 1000 RPM
  // Smooth: no jump of the slope anywhere.
  for (double i = -3.0; i < 3.0; i += 0.01) EXPECT_LT(std::fabs(u_V(i + 0.01) - 2 * u_V(i) + u_V(i - 0.01)), 2e-4);
}

TEST(Sensing, CountsHaveTheScaleSignAndZeroOfTheBoard) {
  SensingParameters p;
  p.noise_counts = p.bus_noise_counts = 0.0;
  Sensing sensing(p, rotorloop::RandomStream(1, 1));
  const std::array<double, 3> open = {5e-6, 5e-6, 5e-6};
  const AdcReading zero = sensing.sample({}, open, 15.0, 298.15), ten = sensing.sample({10.0, -10.0, 0.0}, open, 15.0, 308.15);
  EXPECT_NEAR(zero.phase[0], 2553, 1);
  EXPECT_NEAR(ten.phase[0] - zero.phase[0], -340, 1);  // 27.43 mV/A, inverted, 0.8057 mV per count
  EXPECT_NEAR(ten.phase[1] - zero.phase[1], 340, 1);
  EXPECT_NEAR(zero.bus, 15.0 * 0.09626 / 3.3 * 4096, 1);
  EXPECT_NEAR(ten.temperature - zero.temperature, 0.19 / 3.3 * 4096, 1);
}

TEST(Sensing, ALowSideWindowTooShortToSettleReadsLow) {
  SensingParameters p;
  p.noise_counts = 0.0;
  Sensing sensing(p, rotorloop::RandomStream(1, 1));
  const auto read = [&](double window_s) { return 2553 - sensing.sample({20.0, 0, 0}, {window_s, 1e-5, 1e-5}, 15.0, 300.0).phase[0]; };
  EXPECT_NEAR(read(2e-6), 681, 2);
  EXPECT_NEAR(read(0.65e-6), 340, 3);
  EXPECT_NEAR(read(-1e-6), 0, 2);
}

TEST(Sensing, WithTheLowSideOffForAMicrosecondAnAmplifierShowsItsDriftedZeroAndNothingOfTheCurrent) {
  SensingParameters p;
  p.noise_counts = 0.0;
  p.offset_counts = {5.0, 0.0, 0.0};
  p.drift_counts = {20.0, 0.0, 0.0};
  Sensing sensing(p, rotorloop::RandomStream(1, 1));
  sensing.set_drift_share(0.5);
  const auto read = [&](double off_s) { return sensing.sample_unloaded({20.0, 0, 0}, {off_s, 1e-5, 1e-5})[0] - 2553; };
  EXPECT_NEAR(read(2e-6), 15, 1);
  EXPECT_NEAR(read(0.65e-6), 15 - 340, 3);
  EXPECT_NEAR(read(0.0), 15 - 681, 3);
}

TEST(Sensing, NoiseHasTheStatedSizeAndRepeatsBySeed) {
  SensingParameters p;
  Sensing a(p, rotorloop::RandomStream(7, 3)), b(p, rotorloop::RandomStream(7, 3));
  double sum = 0.0, sum2 = 0.0;
  for (int k = 0; k < 20000; ++k) {
    const AdcReading x = a.sample({}, {1e-5, 1e-5, 1e-5}, 15.0, 300.0), y = b.sample({}, {1e-5, 1e-5, 1e-5}, 15.0, 300.0);
    ASSERT_EQ(x.phase, y.phase);
    sum += x.phase[1];
    sum2 += x.phase[1] * x.phase[1];
  }
  const double mean = sum / 20000, rms = std::sqrt(sum2 / 20000 - mean * mean);
  EXPECT_NEAR(rms, std::hypot(2.0, 0.29), 0.1);
}

TEST(Battery, RestsAtOpenCircuitSagsByItsResistanceAndRelaxes) {
  BatteryParameters p;
  p.capacity_A_s = 1e9;  // state of charge stands still
  Battery b(p);
  const double rest = b.voltage_V();
  EXPECT_DOUBLE_EQ(rest, 4 * Battery::open_circuit_cell_V(0.9));
  EXPECT_NEAR(b.step(40.0, 1e-6), rest - 40.0 * p.resistance_ohm, 1e-4);
  for (int k = 0; k < 20000; ++k) b.step(40.0, 0.5e-3);
  EXPECT_NEAR(b.voltage_V(), rest - 40.0 * (p.resistance_ohm + p.relaxation_ohm), 2e-3);
  for (int k = 0; k < 20000; ++k) b.step(0.0, 0.5e-3);
  EXPECT_NEAR(b.voltage_V(), rest, 1e-3);
}

TEST(Battery, ChargeDrawnIsTheIntegralOfTheFourCurrents) {
  BatteryParameters p;
  Battery b(p);
  const std::array<double, 4> each = {5.0, 6.0, 7.0, 9.0};
  for (int k = 0; k < 20000; ++k) b.step(each, 0.5e-3);
  EXPECT_NEAR(b.charge(), 0.9 - 27.0 * 10.0 / p.capacity_A_s, 1e-9);
}

TEST(Battery, ASupplyThatCannotSinkLetsTheBusRiseByTheCapacitorsLaw) {
  BatteryParameters p;
  p.can_sink = false;
  Battery b(p);
  const double rest = b.voltage_V();
  for (int k = 0; k < 1000; ++k) b.step(-5.0, 1e-6);
  EXPECT_NEAR(b.voltage_V(), rest + 5.0 * 1e-3 / 1000e-6, 0.2);
  BatteryParameters sink;
  Battery c(sink);
  for (int k = 0; k < 1000; ++k) c.step(-5.0, 1e-6);
  EXPECT_LT(c.voltage_V(), rest + 0.2);
}

TEST(Drive, BusEnergyIsMotionCopperFrictionAndDiodes) {
  DriveParameters p;
  p.motor.cogging_N_m = 0.0;
  Drive drive(p, rotorloop::RandomStream(1, 1));
  drive.set_bus_V(15.0);
  double lost_J = 0.0;
  const PwmCommand pwm{{1000, 850, 800}, 1771, true};
  for (int k = 0; k < 2000; ++k) {
    drive.step(pwm);
    const auto& s = drive.motor().state();
    const PhaseCurrents i = drive.phase_currents_A();
    const double diodes_W = 2.0 * 800e-9 * 48000.0 * 0.8 * (std::fabs(i.u) + std::fabs(i.v) + std::fabs(i.w));
    lost_J += (1.5 * 0.064 * (s.i_d_A * s.i_d_A + s.i_q_A * s.i_q_A) + 2e-3 * std::fabs(s.omega_rad_s) + diodes_W) * kPwm_s;
  }
  const double balance_J = lost_J + drive.motor().kinetic_energy_J() + drive.motor().magnetic_energy_J();
  EXPECT_NEAR(drive.bus_energy_J(), balance_J, 0.02 * balance_J);
}

}  // namespace
