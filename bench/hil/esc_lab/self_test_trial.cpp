#include "bench/hil/esc_lab/self_test_trial.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "bench/hil/esc_lab/esc_run.hpp"

namespace rotorloop::esc_lab {
namespace {

using firmware::Broken;
using firmware::SelfTest;

// A 1103 of a whoop; typical data as the other classes are.
constexpr MotorClass kWhoop{"whoop", LabBoard::small, 2, 8000, 6, 0.170, 6e-6, 5e-8, 2e-8, 3e-11, 0.15e-3, 0.1e-3, 8.0, 600.0};

sim::DriveFaultKind kind_of(Broken what) {
  switch (what) {
    case Broken::high_open:
      return sim::DriveFaultKind::high_fet_open;
    case Broken::low_open:
      return sim::DriveFaultKind::low_fet_open;
    case Broken::high_short:
      return sim::DriveFaultKind::high_fet_short;
    case Broken::low_short:
      return sim::DriveFaultKind::low_fet_short;
    default:
      return sim::DriveFaultKind::phase_open;
  }
}

template <class Esc>
SelfTestOutcome run_on(const EscDraw& d, const SelfTestConditions& conditions) {
  sim::NativeEscConfig c = native_config(d);
  Esc esc(c);
  esc.couple_quadratic(d.load_N_m_s2, d.bus_V);
  sim::MotorState& state = esc.drive().motor().state();
  // Cogging turns a rotor that was let go anywhere; the test shall answer for its own share.
  const int periods = static_cast<int>(0.4 * kPeriodsPerMs * 1000);
  for (int k = 0; k < periods; ++k) esc.drive().step({});
  state.omega_rad_s = conditions.omega_rad_s;
  if (conditions.fault) esc.drive().add_fault({.kind = kind_of(conditions.fault->what), .phase = conditions.fault->leg});
  double from_rad = state.angle_rad;
  SelfTestOutcome o;
  int begun = -1;
  const auto step = [&] {
    esc.step_current_loop();
    const sim::PhaseCurrents i = esc.drive().phase_currents_A();
    o.peak_A = std::max({o.peak_A, std::fabs(i.u), std::fabs(i.v), std::fabs(i.w)});
    o.turned_deg = std::max(o.turned_deg, std::fabs(state.angle_rad - from_rad) * d.drive.motor.pole_pairs * 180.0 / std::numbers::pi);
  };
  for (int k = 0; k < 1000 * kPeriodsPerMs; ++k) {
    step();
    if (begun < 0) from_rad = state.angle_rad;
    if (begun < 0 && esc.board().bridge) begun = k;
    const firmware::Telemetry t = esc.telemetry();
    o.result = t.self_test.result;
    o.broken = t.self_test.broken;
    o.leg = t.self_test.leg;
    o.ms = begun < 0 ? 0.0 : (k + 1 - begun) / static_cast<double>(kPeriodsPerMs);
    if (o.result != SelfTest::due) break;
  }
  o.supply_shorted_us = 1e6 * esc.drive().shorted_s();
  if (o.result != SelfTest::failed) return o;
  esc.set_setpoint(speed(static_cast<double>(d.firmware.min_speed_rad_s)));
  for (int k = 0; k < 30 * kPeriodsPerMs; ++k) {
    esc.step_current_loop();
    o.driven_afterwards |= esc.board().bridge;
    if (k == 20 * kPeriodsPerMs) esc.set_setpoint({});
    if (k == 22 * kPeriodsPerMs) esc.set_setpoint(speed(static_cast<double>(d.firmware.min_speed_rad_s)));
  }
  return o;
}

}  // namespace

std::span<const MotorClass> self_test_classes() {
  static const std::vector<MotorClass> kAll = [] {
    std::vector<MotorClass> all(motor_classes().begin(), motor_classes().end());
    all.push_back(kWhoop);
    return all;
  }();
  return kAll;
}

EscDraw draw_for_self_test(const MotorClass& c, std::uint64_t seed) {
  EscDraw d = draw_esc(c, seed, Knowledge::data_sheet);
  if (c.board == LabBoard::small) d.firmware.overvoltage_V = 11.0f;
  return d;
}

std::span<const BridgeFault> bridge_faults() {
  static const std::vector<BridgeFault> kAll = [] {
    std::vector<BridgeFault> all;
    for (const Broken what : {Broken::high_open, Broken::low_open, Broken::high_short, Broken::low_short, Broken::phase_open})
      for (std::uint8_t leg = 0; leg < 3; ++leg) all.push_back({what, leg});
    return all;
  }();
  return kAll;
}

SelfTestOutcome run_self_test(const EscDraw& d, const SelfTestConditions& conditions) {
  return with_esc_of(d.board, [&]<class Esc>() { return run_on<Esc>(d, conditions); });
}

}  // namespace rotorloop::esc_lab
