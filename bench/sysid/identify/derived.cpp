#include "bench/sysid/identify/derived.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/sysid/estimate/model/model.hpp"
#include "host/base/constants.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::identify {
namespace {

constexpr double kStep_m_s = 0.01;
constexpr double kClear_radii = 24.0;   // above the ground where no ceiling is known: neither is felt there
constexpr double kSpeedSettled = 1e-9;  // relative move of rotor speed that ends the search for the one that carries the weight

// Level and without rates, all rotors alike, in the middle of the room, or clear of the ground: with every term of the model.
class LevelFlight {
 public:
  explicit LevelFlight(const estimate::ModelValues& v) : model_(v), weight_N_(v[estimate::kMass] * kGravity_m_s2) {
    const host::LoadGeometry& g = v.geometry;
    x_.p_W_m.z() = std::isfinite(g.ceiling_z_m) ? 0.5 * (g.ground_z_m + g.ceiling_z_m) : g.ground_z_m + kClear_radii * g.radius_m;
  }
  Eigen::Vector3d force_B_N(double omega_rad_s, double forward_m_s, double climb_m_s) {
    x_.v_W_m_s = {forward_m_s, 0.0, climb_m_s};
    estimate::RotorInputSample u;
    u.omega_rad_s.fill(omega_rad_s);
    return model_.instant(x_, u, 0.0).force_B_N;
  }
  // The rotor speed that carries the weight, from a first guess.
  double omega_rad_s(double guess_rad_s, double forward_m_s) {
    double omega = guess_rad_s;
    for (int i = 0; i < 20; ++i) {
      const double lift = force_B_N(omega, forward_m_s, 0.0).z();
      const double step = 1e-4 * omega;
      const double slope = (force_B_N(omega + step, forward_m_s, 0.0).z() - lift) / step;
      if (!(slope > 0.0)) break;
      const double move = std::clamp((weight_N_ - lift) / slope, -0.3 * omega, 0.3 * omega);
      omega += move;
      if (std::fabs(move) < kSpeedSettled * omega) break;
    }
    return omega;
  }

 private:
  estimate::Model model_;
  double weight_N_;
  estimate::BodyState x_;
};

}  // namespace

DerivedQuantity propagated(const estimate::Fit& fit, const std::function<double(const estimate::ModelValues&)>& function) {
  DerivedQuantity out;
  const estimate::ModelValues& at = fit.values.front();
  out.value = function(at);
  const auto n = static_cast<Eigen::Index>(fit.estimates.size());
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const estimate::Estimate& e = fit.estimates[static_cast<std::size_t>(i)];
    if (e.flight > 0) continue;
    const double step =
        1e-3 * std::max(std::min(e.u, 0.1 * std::fabs(e.value)), 1e-4 * estimate::parameter_info(e.parameter, at.terms).scale);
    estimate::ModelValues up = at, down = at;
    up[e.parameter] += step;
    down[e.parameter] -= step;
    gradient[i] = (function(up) - function(down)) / (2.0 * step);
  }
  out.u = std::sqrt(std::max(0.0, gradient.dot(fit.covariance * gradient)));
  out.u_robust = std::sqrt(std::max(0.0, gradient.dot(fit.robust_covariance * gradient)));
  return out;
}

std::vector<DerivedQuantity> derived_quantities(const estimate::Fit& fit, const host::VehicleModel& base, double speed) {
  std::vector<DerivedQuantity> out;
  const auto add = [&](std::string id, std::string symbol, std::string meaning, std::string unit, auto&& function) {
    DerivedQuantity d = propagated(fit, function);
    d.id = std::move(id);
    d.symbol = std::move(symbol);
    d.meaning = std::move(meaning);
    d.unit = std::move(unit);
    out.push_back(std::move(d));
  };
  const auto hover = [&base](const estimate::ModelValues& v, LevelFlight& f) {
    return f.omega_rad_s(host::hover_omega_rad_s(estimate::vehicle_model(v, base)), 0.0);
  };
  add("static_c_t", "c_t", "static thrust coefficient of eq. (1)-(2), that of hover", "N s2",
      [&](const estimate::ModelValues& v) { return host::static_c_t(estimate::vehicle_model(v, base).thrust); });
  add("hover_speed", "ω_hover", "rotor speed in hover", "RPM", [&](const estimate::ModelValues& v) {
    LevelFlight f(v);
    return hover(v, f) * 30.0 / std::numbers::pi;
  });
  add("thrust_by_climb", "dT/dv_z", "thrust of all rotors by climb speed, about hover", "N s/m", [&](const estimate::ModelValues& v) {
    LevelFlight f(v);
    const double omega = hover(v, f);
    return (f.force_B_N(omega, 0.0, kStep_m_s).z() - f.force_B_N(omega, 0.0, -kStep_m_s).z()) / (2.0 * kStep_m_s);
  });
  add("total_drag", fmt::format("D({:g} m/s)", speed), "drag in level flight, rotors and airframe", "N",
      [&](const estimate::ModelValues& v) {
        LevelFlight f(v);
        return -f.force_B_N(f.omega_rad_s(hover(v, f), speed), speed, 0.0).x();
      });
  add("izz_by_cq", "I_zz/c_q", "yaw inertia by torque coefficient: one flaw of a model moves both together", "m2/N",
      [](const estimate::ModelValues& v) { return v[estimate::kIzz] / v[estimate::kCq]; });
  add("figure_of_merit", "FM", "ideal by real power in hover; credible: 0.3 to 0.85", "1", [&](const estimate::ModelValues& v) {
    const host::VehicleModel m = estimate::vehicle_model(v, base);
    return host::figure_of_merit(m.thrust, m.c_q_N_m_s2);
  });
  return out;
}

}  // namespace rotorloop::identify
