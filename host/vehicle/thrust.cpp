#include "host/vehicle/thrust.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::host {

namespace {

bool usable(const ThrustModel& m) {
  return std::isfinite(m.k1_N_s2) && std::isfinite(m.k2_N_s2_m) && m.k1_N_s2 > 0.0 && m.radius_m > 0.0 && m.air_density_kg_m3 > 0.0 &&
         std::isfinite(m.radius_m) && std::isfinite(m.air_density_kg_m3);
}

// The largest root of q u² + b u - c = 0 for c >= 0, in the form that does not cancel.
double positive_root(double q, double b, double c) {
  const double s = std::sqrt(b * b + 4.0 * q * c);
  return b > 0.0 ? 2.0 * c / (b + s) : (s - b) / (2.0 * q);
}

}  // namespace

RotorThrust solve_thrust(const ThrustModel& model, double omega_rad_s, double v_z_m_s, double v_xy_m_s) {
  RotorThrust out;
  if (!usable(model) || !std::isfinite(omega_rad_s) || !std::isfinite(v_z_m_s) || !std::isfinite(v_xy_m_s)) {
    out.status = ThrustStatus::bad_input;
    return out;
  }
  const double omega = std::fabs(omega_rad_s);
  if (omega < kStopped_rad_s) {
    out.status = ThrustStatus::stopped;
    out.c_t_N_s2 = static_c_t(model);
    return out;
  }
  // Unknown: u = v_z + v_i, the flow through the disk. The difference of (2) and (1) as a function of u:
  const double q = model.momentum_kg_m(), k1 = model.k1_N_s2 * omega * omega, k2 = model.k2_N_s2_m * omega;
  const double w2 = v_xy_m_s * v_xy_m_s;
  const auto difference = [&](double u) { return q * (u - v_z_m_s) * std::sqrt(u * u + w2) - k2 * u - k1; };
  const auto slope = [&](double u) {
    const double s = std::sqrt(u * u + w2);
    return q * s + (s > 0.0 ? q * (u - v_z_m_s) * u / s : 0.0) - k2;
  };
  // Without cross flow the root is closed. Cross flow only adds momentum, so for T > 0 it lies at or below that one.
  double u = positive_root(q, -(k2 + q * v_z_m_s), k1);
  double low = std::min(v_z_m_s, 0.0), high = std::max(u, std::max(v_z_m_s, 0.0));
  // Newton from above, kept inside the bracket by bisection: in fast descent with cross flow the difference is not monotonic.
  constexpr int kMaxIterations = 60;
  bool converged = w2 == 0.0;
  while (!converged && out.iterations < kMaxIterations) {
    ++out.iterations;
    const double f = difference(u);
    (f > 0.0 ? high : low) = u;
    const double d = slope(u);
    double next = d > 0.0 ? u - f / d : low - 1.0;
    converged = d > 0.0 && std::fabs(next - u) <= 1e-12 * (1.0 + std::fabs(u));
    if (!converged && !(next > low && next < high)) {
      next = 0.5 * (low + high);
      converged = high - low <= 1e-12 * (1.0 + std::fabs(u));
    }
    u = next;
  }
  out.induced_m_s = u - v_z_m_s;
  out.thrust_N = k1 + k2 * u;
  out.c_t_N_s2 = out.thrust_N / (omega * omega);
  const double hover_induced = std::sqrt(std::max(out.thrust_N, 0.0) / q);
  if (!converged) {
    out.status = ThrustStatus::not_converged;
  } else if (out.thrust_N < 0.0) {
    out.status = ThrustStatus::negative_thrust;
  } else if (v_z_m_s < -kVortexRingOnset * hover_induced && std::fabs(v_xy_m_s) < hover_induced) {
    out.status = ThrustStatus::deep_descent;
  }
  return out;
}

double static_c_t(const ThrustModel& model) {
  if (!usable(model)) return 0.0;
  const double u = positive_root(model.momentum_kg_m(), -model.k2_N_s2_m, model.k1_N_s2);
  return model.momentum_kg_m() * u * u;
}

double figure_of_merit(const ThrustModel& model, double c_q_N_m_s2) {
  const double c_t = static_c_t(model);
  return c_t * std::sqrt(c_t / model.momentum_kg_m()) / c_q_N_m_s2;
}

double hover_omega_rad_s(const VehicleModel& model) { return std::sqrt(model.weight_N() / (kRotors * static_c_t(model.thrust))); }

}  // namespace rotorloop::host
