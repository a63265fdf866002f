#include "bench/identify/derived.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/vehicle/thrust.hpp"

namespace rotorloop::bench {
namespace {

// Thrust of all rotors at hover speed by climb speed: what damps the vertical motion.
double thrust_by_climb(const host::VehicleModel& m) {
  constexpr double kStep_m_s = 0.01;
  const double omega = host::hover_omega_rad_s(m);
  const auto thrust = [&](double v) { return host::kRotors * host::solve_thrust(m.thrust, omega, v, 0.0).thrust_N; };
  return (thrust(kStep_m_s) - thrust(-kStep_m_s)) / (2.0 * kStep_m_s);
}

}  // namespace

DerivedQuantity propagated(const Fit& fit, const std::function<double(const ModelValues&)>& function) {
  DerivedQuantity out;
  const ModelValues& at = fit.values.front();
  out.value = function(at);
  const auto n = static_cast<Eigen::Index>(fit.estimates.size());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Estimate& e = fit.estimates[static_cast<std::size_t>(i)];
    if (e.flight > 0) continue;
    const double step = 1e-3 * std::max(std::min(e.u, 0.1 * std::fabs(e.value)), 1e-4 * parameter_info(e.parameter, at.terms).scale);
    ModelValues up = at, down = at;
    up[e.parameter] += step;
    down[e.parameter] -= step;
    gradient[i] = (function(up) - function(down)) / (2.0 * step);
  }
  out.u = std::sqrt(std::max(0.0, gradient.dot(fit.covariance * gradient)));
  out.u_robust = std::sqrt(std::max(0.0, gradient.dot(fit.robust_covariance * gradient)));
  return out;
}

std::vector<DerivedQuantity> derived_quantities(const Fit& fit, const host::VehicleModel& base, double speed) {
  std::vector<DerivedQuantity> out;
  const auto add = [&](std::string id, std::string symbol, std::string meaning, std::string unit, auto&& function) {
    DerivedQuantity d = propagated(fit, [&](const ModelValues& v) { return function(vehicle_model(v, base)); });
    d.id = std::move(id);
    d.symbol = std::move(symbol);
    d.meaning = std::move(meaning);
    d.unit = std::move(unit);
    out.push_back(std::move(d));
  };
  using Vehicle = host::VehicleModel;
  add("static_c_t", "c_t", "static thrust coefficient, that of hover", "N s2", [](const Vehicle& m) { return host::static_c_t(m.thrust); });
  add("hover_speed", "ω_hover", "rotor speed in hover", "RPM",
      [](const Vehicle& m) { return host::hover_omega_rad_s(m) * 30.0 / std::numbers::pi; });
  add("thrust_by_climb", "dT/dv_z", "thrust of all rotors by climb speed, about hover", "N s/m", thrust_by_climb);
  add("total_drag", fmt::format("D({:g} m/s)", speed), "drag in level flight, rotors and airframe, thrust taken as the weight", "N",
      [speed](const Vehicle& m) { return m.weight_N() * m.drag.c_dh_s_m * speed + m.drag.c_dxy_N_s2_m2 * speed * speed; });
  add("izz_by_cq", "I_zz/c_q", "yaw inertia by torque coefficient: one flaw of a model moves both together", "m2/N",
      [](const Vehicle& m) { return m.inertia_kg_m2[2] / m.c_q_N_m_s2; });
  add("figure_of_merit", "FM", "ideal by real power in hover; credible: 0.3 to 0.85", "1",
      [](const Vehicle& m) { return host::figure_of_merit(m.thrust, m.c_q_N_m_s2); });
  return out;
}

}  // namespace rotorloop::bench
