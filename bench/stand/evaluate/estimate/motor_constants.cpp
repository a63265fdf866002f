#include "bench/stand/evaluate/estimate/motor_constants.hpp"

#include <cmath>
#include <numbers>

#include "host/base/block_fit.hpp"

namespace rotorloop::stand {
namespace {

constexpr std::size_t kFewestSteps = 5;
constexpr std::size_t kFewestForLost = 8;
constexpr double kLeastEfficiency = 0.5;  // a motor without current along the magnet has more wherever its EMF exceeds its drop

// Between two samples of the ESC's current loop (24 kHz on each of its boards) its voltage is held while the rotor turns on by an angle x:
// the held vector that stands against a turning EMF is shorter by sin(x/2)/(x/2), and the mean current of the period lies on the chord of
// the sampled ones, cos(x/2) of them. At 1400 rad/s and seven pole pairs this is 0.7 and 2 %.
constexpr double kSample_s = 1.0 / 24'000.0;

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

struct Steps {
  std::vector<Electrical> electrical;
  double winding_degC = kNotMeasured;  // mean
};
Steps usable_steps(const StandRun& run, double running_offset_N_m, double inductance_H) {
  Steps out;
  double warmth = 0.0, warm = 0.0;
  for (const StandStep& s : run.steps) {
    if (!(s.omega_rad_s > 0.0) || !(s.duty > 0.0) || !(s.voltage_V > 0.0) || !(s.current_A > 0.0)) continue;
    // Current along the magnet, as some ESCs hold at low speed, takes power and makes no torque: such steps say nothing of R.
    if (s.torque_N_m == s.torque_N_m && (s.torque_N_m - running_offset_N_m) * s.omega_rad_s < kLeastEfficiency * s.voltage_V * s.current_A)
      continue;
    out.electrical.push_back(electrical(s, run.facts.duty_along ? 0.0 : inductance_H * run.facts.pole_pairs));
    if (s.winding_degC == s.winding_degC) {
      warmth += s.winding_degC;
      warm += 1.0;
    }
  }
  if (warm > 0.0) out.winding_degC = warmth / warm;
  return out;
}

struct VoltageFit {
  MotorValue emf_V_s, resistance_ohm;
  double rms = 0.0;
};
struct KnownMotor {
  double phase_ohm;
  double half_turn;  // electrical angle of half a sample period, for a mechanical rad/s
};
// `known`: R is not fitted. `along`: the voltage is the one that the ESC meant along the torque axis; what dead times take of it beyond
// their compensation is a constant.
VoltageFit fit_voltage(const std::vector<Electrical>& e, bool along, const std::optional<KnownMotor>& known) {
  const auto n = static_cast<Eigen::Index>(e.size());
  const bool lost = along && e.size() >= kFewestForLost;
  Eigen::MatrixXd X(n, 1 + !known + lost);
  Eigen::VectorXd u(n);
  std::vector<int> block;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Electrical& x = e[static_cast<std::size_t>(i)];
    const double half = along && known ? known->half_turn * x.omega_rad_s : 0.0;
    // Relative errors: what is wrong with a voltmeter is its gain.
    X(i, 0) = x.omega_rad_s * (half > 0.0 ? std::sin(half) / half : 1.0) / x.along_V;
    if (!known) X(i, 1) = x.amplitude_A / x.along_V;
    if (lost) X(i, X.cols() - 1) = 1.0 / x.along_V;
    u(i) = known ? 1.0 - known->phase_ohm * std::cos(half) * x.amplitude_A / x.along_V : 1.0;
    block.push_back(static_cast<int>(i));
  }
  const BlockFit f = fit_in_blocks(X, u, block);
  return {{f.c(0), f.u(0)}, known ? MotorValue{known->phase_ohm, 0.0} : MotorValue{f.c(1), f.u(1)}, f.rms};
}

void add_friction(MotorConstants& m, const std::vector<Electrical>& e, double running_offset_N_m) {
  const auto n = static_cast<Eigen::Index>(e.size());
  Eigen::MatrixXd Y(n, 2);
  Eigen::VectorXd A(n);
  std::vector<int> block;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Electrical& x = e[static_cast<std::size_t>(i)];
    if (x.torque_N_m != x.torque_N_m) return;
    Y.row(i) << x.torque_N_m - running_offset_N_m, 1.0;
    A(i) = x.amplitude_A;
    block.push_back(static_cast<int>(i));
  }
  const BlockFit g = fit_in_blocks(Y, A, block);
  m.no_load_current_A = MotorValue{g.c(1), g.u(1)};
  m.friction_N_m = MotorValue{1.5 * m.emf_V_s.value * g.c(1), 1.5 * m.emf_V_s.value * g.u(1)};
}

}  // namespace

std::optional<MotorConstants> motor_constants(const StandRun& run, double running_offset_N_m, double inductance_H) {
  const auto& winding = run.facts.winding;
  if (inductance_H == 0.0 && winding) inductance_H = 0.5 * (winding->inductance_d_H + winding->inductance_q_H);
  const Steps steps = usable_steps(run, running_offset_N_m, inductance_H);
  const std::vector<Electrical>& e = steps.electrical;
  if (e.size() < kFewestSteps) return std::nullopt;
  const bool along = run.facts.duty_along;
  const double half_turn = 0.5 * kSample_s * run.facts.pole_pairs;
  const auto known = winding ? std::optional(KnownMotor{winding->phase_ohm, half_turn}) : std::nullopt;
  const VoltageFit f = fit_voltage(e, along, known);
  MotorConstants m;
  m.steps = e.size();
  m.relative_rms = f.rms;
  m.winding = winding;
  const double relative_V = run.known.voltage.u, relative_A = run.known.current.u;
  m.emf_V_s = {f.emf_V_s.value, std::hypot(f.emf_V_s.u, f.emf_V_s.value * relative_V)};
  if (winding) {
    const double u_ohm = winding->phase_ohm * winding->u_resistance;
    // An R that is higher by its u leaves this much less for the rotor.
    const double by_resistance = fit_voltage(e, along, KnownMotor{winding->phase_ohm + u_ohm, half_turn}).emf_V_s.value - m.emf_V_s.value;
    m.emf_V_s.u = std::hypot(m.emf_V_s.u, by_resistance);
    m.resistance_ohm = {winding->phase_ohm, u_ohm};
    m.winding_degC = winding->degC;
  } else {
    m.resistance_ohm = {f.resistance_ohm.value,
                        std::hypot(f.resistance_ohm.u, f.resistance_ohm.value * std::hypot(relative_V, relative_A))};
    m.winding_degC = steps.winding_degC;
  }
  m.speed_constant_rpm_V.value = 60.0 / (std::sqrt(3.0) * 2.0 * std::numbers::pi * m.emf_V_s.value);
  m.speed_constant_rpm_V.u = m.speed_constant_rpm_V.value * m.emf_V_s.u / m.emf_V_s.value;
  if (run.facts.pole_pairs > 0) {
    const double p = run.facts.pole_pairs;
    m.flux_linkage_Wb = MotorValue{m.emf_V_s.value / p, m.emf_V_s.u / p};
  }
  if (run.checked.torque != StandChannelState::absent) add_friction(m, e, running_offset_N_m);
  return m;
}

}  // namespace rotorloop::stand
