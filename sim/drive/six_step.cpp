#include "sim/drive/six_step.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace rotorloop::sim {
namespace {
constexpr double kSectorMean = 3.0 / std::numbers::pi;  // of cos over +-30 degrees; also the commutation drop per w_e L I
constexpr int kBisections = 60;                         // from 1e4 rad/s to the last bit

// I_c over I.
double switched_over_mean(double v_V, double emf_V, double bus_V) {
  const double dip_high = (2.0 * emf_V - v_V) / (v_V + emf_V), dip_low = (2.0 * emf_V + bus_V - 2.0 * v_V) / (2.0 * bus_V - v_V + emf_V);
  return 1.0 / (1.0 - 0.25 * (dip_high + dip_low));
}

double friction(const SixStepParameters& p, double omega_rad_s) { return p.static_friction_N_m + p.viscous_friction_N_m_s * omega_rad_s; }

double surplus_N_m(const SixStepParameters& p, double bus_V, double duty, const LoadTorque& load, double omega_rad_s) {
  return six_step_at(p, bus_V, duty, omega_rad_s).electromagnetic_N_m - friction(p, omega_rad_s) - load(omega_rad_s);
}
}  // namespace

double six_step_emf_constant_V_s(EmfShape shape, double flux_linkage_Wb, int pole_pairs) {
  return (shape == EmfShape::sinusoidal ? kSectorMean * std::numbers::sqrt3 : 2.0) * pole_pairs * flux_linkage_Wb;
}

double six_step_emf_constant_V_s(double no_load_rpm_per_V) { return 30.0 / (std::numbers::pi * no_load_rpm_per_V); }

SixStepPoint six_step_at(const SixStepParameters& p, double bus_V, double duty, double omega_rad_s) {
  SixStepPoint s;
  s.omega_rad_s = omega_rad_s;
  const double emf_V = p.emf_constant_V_s * omega_rad_s, electrical_rad_s = p.pole_pairs * omega_rad_s;
  const double v_V = duty * bus_V, switched = switched_over_mean(v_V, emf_V, bus_V);
  const double reactance_ohm = kSectorMean * electrical_rad_s * p.phase_inductance_H * switched;
  s.current_A = (v_V - emf_V) / (p.resistance_ohm + reactance_ohm);
  s.commutation_drop_V = reactance_ohm * s.current_A;
  s.electromagnetic_N_m = p.emf_constant_V_s * s.current_A;
  s.friction_N_m = friction(p, omega_rad_s);
  s.resistive_loss_W = p.resistance_ohm * s.current_A * s.current_A;
  s.switching_loss_W = 0.5 * bus_V * std::fabs(s.current_A) * p.switching_time_s * p.pwm_Hz;
  s.bus_current_A = (s.electromagnetic_N_m * omega_rad_s + s.resistive_loss_W + s.switching_loss_W) / bus_V;
  const double leaving_s = 3.0 * p.phase_inductance_H * switched * std::fabs(s.current_A) / (v_V + emf_V);
  s.overlap_share = leaving_s * electrical_rad_s * kSectorMean;
  return s;
}

double six_step_duty(const SixStepParameters& p, double bus_V, double omega_rad_s, double current_A) {
  double low = 0.0, high = 1.0;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (six_step_at(p, bus_V, middle, omega_rad_s).current_A < current_A ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

SixStepPoint six_step_steady(const SixStepParameters& p, double bus_V, double duty, const LoadTorque& load) {
  if (surplus_N_m(p, bus_V, duty, load, 0.0) <= 0.0) return six_step_at(p, bus_V, duty, 0.0);
  // Surplus torque falls with speed and is negative where the EMF alone takes all of d V.
  double low = 0.0, high = duty * bus_V / p.emf_constant_V_s;
  for (int i = 0; i < kBisections && high > low; ++i) {
    const double middle = 0.5 * (low + high);
    (surplus_N_m(p, bus_V, duty, load, middle) > 0.0 ? low : high) = middle;
  }
  return six_step_at(p, bus_V, duty, 0.5 * (low + high));
}

double six_step_advance(const SixStepParameters& p, double inertia_kg_m2, double bus_V, double duty, const LoadTorque& load,
                        double omega_rad_s, double dt_s) {
  const auto slope = [&](double w) { return surplus_N_m(p, bus_V, duty, load, w) / inertia_kg_m2; };
  const double middle = std::max(0.0, omega_rad_s + 0.5 * dt_s * slope(omega_rad_s));
  return std::max(0.0, omega_rad_s + dt_s * slope(middle));
}

}  // namespace rotorloop::sim
