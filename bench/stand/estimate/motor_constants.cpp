#include "bench/stand/estimate/motor_constants.hpp"

#include <cmath>
#include <numbers>

#include "bench/stand/block_fit.hpp"

namespace rotorloop::stand {
namespace {

constexpr std::size_t kFewestSteps = 5;
constexpr std::size_t kFewestForLost = 8;
constexpr double kLeastEfficiency = 0.5;  // a motor without current along the magnet has more wherever its EMF exceeds its drop

struct Electrical {
  double omega_rad_s, along_V, amplitude_A, torque_N_m;
};

// Voltage along the torque axis and current amplitude. The inductive drop stands across: u² = (u cos φ)² + (ω_e L A)².
Electrical electrical(const StandStep& s, double reactance_per_omega) {
  const double u = s.duty * s.voltage_V / std::sqrt(3.0), power_W = s.voltage_V * s.current_A;
  double along = u;
  for (int i = 0; i < 20; ++i) {
    const double A = 2.0 * power_W / (3.0 * along), across = s.omega_rad_s * reactance_per_omega * A;
    along = std::sqrt(std::max(0.25 * u * u, u * u - across * across));
  }
  return {s.omega_rad_s, along, 2.0 * power_W / (3.0 * along), s.torque_N_m};
}

}  // namespace

std::optional<MotorConstants> motor_constants(const StandRun& run, double running_offset_N_m, double inductance_H) {
  std::vector<Electrical> e;
  double warmth = 0.0, warm = 0.0;
  for (const StandStep& s : run.steps) {
    if (!(s.omega_rad_s > 0.0) || !(s.duty > 0.0) || !(s.voltage_V > 0.0) || !(s.current_A > 0.0)) continue;
    // Current along the magnet, as some ESCs hold at low speed, takes power and makes no torque: such steps say nothing of R.
    if (s.torque_N_m == s.torque_N_m && (s.torque_N_m - running_offset_N_m) * s.omega_rad_s < kLeastEfficiency * s.voltage_V * s.current_A) continue;
    e.push_back(electrical(s, run.facts.duty_along ? 0.0 : inductance_H * run.facts.pole_pairs));
    if (s.winding_degC == s.winding_degC) warmth += s.winding_degC, warm += 1.0;
  }
  if (e.size() < kFewestSteps) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(e.size());
  const bool lost = run.facts.duty_along && e.size() >= kFewestForLost;
  Eigen::MatrixXd X(n, lost ? 3 : 2), Y(n, 2);
  Eigen::VectorXd u(n), A(n);
  std::vector<int> block;
  bool torque = run.checked.torque != StandChannelState::absent;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Electrical& x = e[static_cast<std::size_t>(i)];
    // Relative errors: what is wrong with a voltmeter is its gain.
    X.row(i).head(2) << x.omega_rad_s / x.along_V, x.amplitude_A / x.along_V;
    if (lost) X(i, 2) = 1.0 / x.along_V;
    u(i) = 1.0;
    Y.row(i) << x.torque_N_m - running_offset_N_m, 1.0;
    A(i) = x.amplitude_A;
    torque &= x.torque_N_m == x.torque_N_m;
    block.push_back(static_cast<int>(i));
  }
  const BlockFit f = fit_in_blocks(X, u, block);
  MotorConstants m;
  m.steps = e.size(), m.relative_rms = f.rms;
  const double relative_V = run.known.voltage.u, relative_A = run.known.current.u;
  m.emf_V_s = {f.c(0), std::hypot(f.u(0), f.c(0) * relative_V)};
  m.speed_constant_rpm_V.value = 60.0 / (std::sqrt(3.0) * 2.0 * std::numbers::pi * m.emf_V_s.value);
  m.speed_constant_rpm_V.u = m.speed_constant_rpm_V.value * m.emf_V_s.u / m.emf_V_s.value;
  m.resistance_ohm = {f.c(1), std::hypot(f.u(1), f.c(1) * std::hypot(relative_V, relative_A))};
  if (warm > 0.0) m.winding_degC = warmth / warm;
  if (run.facts.pole_pairs > 0) {
    const double p = run.facts.pole_pairs;
    m.flux_linkage_Wb = MotorValue{m.emf_V_s.value / p, m.emf_V_s.u / p};
  }
  if (torque) {
    const BlockFit g = fit_in_blocks(Y, A, block);
    m.no_load_current_A = MotorValue{g.c(1), g.u(1)};
    m.friction_N_m = MotorValue{1.5 * m.emf_V_s.value * g.c(1), 1.5 * m.emf_V_s.value * g.u(1)};
  }
  return m;
}

}  // namespace rotorloop::stand
