// Sums the rotors' loads about the centre of mass and integrates the rigid body.
#include "sim/airframe/airframe.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "host/base/elementary.hpp"
#include "host/base/error.hpp"

namespace rotorloop::sim {
namespace {

constexpr std::int64_t kMaxStep_ns = 500'000;

Eigen::Matrix3d tilt_matrix(const Eigen::Vector2d& tilt_rad) {
  const SinCos x = sincos_exact(tilt_rad.x()), y = sincos_exact(tilt_rad.y());
  Eigen::Matrix3d about_x, about_y;
  about_x << 1, 0, 0, 0, x.cos, -x.sin, 0, x.sin, x.cos;
  about_y << y.cos, 0, y.sin, 0, 1, 0, -y.sin, 0, y.cos;
  return about_x * about_y;
}

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) { throw Error({"airframe", what, "", remedy}); }

void check(const AirframeConfig& c) {
  if (!(c.density_kg_m3 > 0.0)) refuse(fmt::format("air density {} kg/m^3 is not positive", c.density_kg_m3), "give kg/m^3");
  if (!(c.mass_kg > 0.0) || !std::isfinite(c.mass_kg)) refuse(fmt::format("mass {} kg is not positive", c.mass_kg), "give the mass in kg");
  if (!c.inertia_kg_m2.allFinite() || !c.inertia_kg_m2.isApprox(c.inertia_kg_m2.transpose()))
    refuse("the inertia matrix is not finite and symmetric", "give six numbers in kg m^2");
  const Eigen::Vector3d principal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(c.inertia_kg_m2).eigenvalues();
  if (!(principal.minCoeff() > 0.0) || principal.sum() < 2.0 * principal.maxCoeff() * (1.0 - 1e-9))
    refuse(fmt::format("no body has the principal moments of inertia {}, {}, {} kg m^2", principal[0], principal[1], principal[2]),
           "each must be positive and at most the sum of the other two");
  if (c.step_ns <= 0 || c.step_ns > kMaxStep_ns)
    refuse(fmt::format("step {} ns is outside 1 to {} ns", c.step_ns, kMaxStep_ns), "use 2 kHz or more");
  for (const RotorMount& r : c.rotors) {
    if (r.spin != 1 && r.spin != -1)
      refuse(fmt::format("rotor spin {} is neither 1 nor -1", r.spin), "use +1 for counter-clockwise seen from above");
    if (!(r.spin_inertia_kg_m2 >= 0.0))
      refuse(fmt::format("rotor inertia {} kg m^2 is negative", r.spin_inertia_kg_m2), "give J in kg m^2");
  }
}

bool credible(const AirframeState& s) {
  return s.p_W_m.allFinite() && s.v_W_m_s.allFinite() && s.q_WB.coeffs().allFinite() && s.w_B_rad_s.allFinite() &&
         s.p_W_m.squaredNorm() <= kMaxDistance_m * kMaxDistance_m && s.v_W_m_s.squaredNorm() <= kMaxSpeed_m_s * kMaxSpeed_m_s &&
         s.w_B_rad_s.squaredNorm() <= kMaxRate_rad_s * kMaxRate_rad_s;
}

// One step of the classical Runge-Kutta method; `rate_at(state, x)`: the rate at a stage at fraction x of the step.
template <class RateAt>
AirframeState runge_kutta_step(const AirframeState& state, double h, RateAt&& rate_at) {
  using Rate = decltype(rate_at(state, 0.0));
  const auto moved = [&](const Rate& d, double dt) {
    AirframeState s = state;
    s.time_ns += static_cast<std::int64_t>(1e9 * dt + 0.5);
    s.p_W_m += dt * d.v_W_m_s;
    s.v_W_m_s += dt * d.a_W_m_s2;
    s.q_WB.coeffs() += dt * d.q_dot;
    s.w_B_rad_s += dt * d.w_dot_B_rad_s2;
    return s;
  };
  const Rate a = rate_at(state, 0.0);
  const Rate b = rate_at(moved(a, 0.5 * h), 0.5);
  const Rate c = rate_at(moved(b, 0.5 * h), 0.5);
  const Rate d = rate_at(moved(c, h), 1.0);
  const auto mean = [](const auto& k1, const auto& k2, const auto& k3, const auto& k4) {
    return ((k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0).eval();
  };
  const Rate average{mean(a.v_W_m_s, b.v_W_m_s, c.v_W_m_s, d.v_W_m_s), mean(a.a_W_m_s2, b.a_W_m_s2, c.a_W_m_s2, d.a_W_m_s2),
                     mean(a.q_dot, b.q_dot, c.q_dot, d.q_dot), mean(a.w_dot_B_rad_s2, b.w_dot_B_rad_s2, c.w_dot_B_rad_s2, d.w_dot_B_rad_s2),
                     mean(a.specific_force_B_m_s2, b.specific_force_B_m_s2, c.specific_force_B_m_s2, d.specific_force_B_m_s2)};
  AirframeState next = moved(average, h);
  next.q_WB.normalize();
  next.specific_force_B_m_s2 = average.specific_force_B_m_s2;
  return next;
}

}  // namespace

// The time derivative of the state, and the force per mass that goes into it.
struct Airframe::Rate {
  Eigen::Vector3d v_W_m_s;
  Eigen::Vector3d a_W_m_s2;
  Eigen::Vector4d q_dot;  // x, y, z, w as Eigen stores them
  Eigen::Vector3d w_dot_B_rad_s2;
  Eigen::Vector3d specific_force_B_m_s2;
};

Airframe::Airframe(const AirframeConfig& config, const AirframeState& initial, std::int64_t release_ns)
    : config_(config), state_(initial), release_ns_(release_ns), status_(AirframeStatus::flying) {
  check(config_);
  inverse_inertia_ = config_.inertia_kg_m2.inverse();
  for (std::size_t i = 0; i < kAirframeRotors; ++i) {
    R_BR_[i] = tilt_matrix(config_.rotors[i].tilt_rad);
    arm_B_m_[i] = config_.rotors[i].hub_m - config_.com_offset_m;
  }
  state_.q_WB.normalize();
  if (!credible(state_)) refuse("the initial state is not finite or beyond credible flight", "check the launch pose");
  state_.specific_force_B_m_s2 = state_.q_WB.conjugate() * Eigen::Vector3d(0.0, 0.0, config_.gravity_m_s2);
  if (state_.time_ns < release_ns_) {
    status_ = AirframeStatus::clamped;
    state_.v_W_m_s.setZero();
    state_.w_B_rad_s.setZero();
  }
}

RotorCondition Airframe::rotor_condition(std::size_t i, double omega_rad_s, const Air& air_at_hub) const {
  const Eigen::Vector3d v_B_m_s = state_.q_WB.conjugate() * (state_.v_W_m_s - air_at_hub.wind_W_m_s);
  const Eigen::Vector3d v_hub_B_m_s = v_B_m_s + state_.w_B_rad_s.cross(arm_B_m_[i]);
  RotorCondition c;
  c.v_R_m_s = R_BR_[i].transpose() * v_hub_B_m_s;
  c.w_R_rad_s = R_BR_[i].transpose() * state_.w_B_rad_s;
  c.omega_rad_s = omega_rad_s;
  c.spin = config_.rotors[i].spin;
  c.density_kg_m3 = air_at_hub.density_kg_m3;
  return c;
}

RotorMomentum Airframe::momentum(std::span<const double, kAirframeRotors> omega_rad_s,
                                 std::span<const double, kAirframeRotors> omega_dot_rad_s2) const {
  RotorMomentum sum;
  for (std::size_t i = 0; i < kAirframeRotors; ++i)
    sum.add({R_BR_[i].col(2), config_.rotors[i].spin, config_.rotors[i].spin_inertia_kg_m2, omega_rad_s[i], omega_dot_rad_s2[i]});
  return sum;
}

BodyMotion Airframe::motion_of(const AirframeState& s, const Air& air, const RotorMomentum& rotors) const {
  BodyMotion m;
  m.time_s = static_cast<double>(s.time_ns) * 1e-9;
  m.p_W_m = s.p_W_m;
  m.v_W_m_s = s.v_W_m_s;
  m.R_WB = s.q_WB.normalized().toRotationMatrix();  // a stage's quaternion is not of unit length
  m.w_B_rad_s = s.w_B_rad_s;
  m.v_air_B_m_s = m.R_WB.transpose() * (s.v_W_m_s - air.wind_W_m_s);
  m.density_kg_m3 = air.density_kg_m3;
  m.rotors = rotors;
  return m;
}

Airframe::Loads Airframe::sum_of_rotors(std::span<const RotorLoads, kAirframeRotors> loads) const {
  Loads sum;
  for (std::size_t i = 0; i < kAirframeRotors; ++i) {
    const RotorLoads& l = loads[i];
    const Eigen::Vector3d force_B_N = R_BR_[i] * l.force_R_N;
    sum.force_B_N += force_B_N;
    sum.moment_B_N_m += R_BR_[i] * l.moment_R_N_m + arm_B_m_[i].cross(force_B_N);
  }
  return sum;
}

Airframe::Rate Airframe::rate(const AirframeState& s, const Loads& loads, const RotorMomentum& rotors, const Air& air,
                              const BodyLoads* further) const {
  const BodyMotion m = motion_of(s, air, rotors);
  Wrench more;
  if (further) further->add_to(more, m);
  const Eigen::Vector3d force_B_N = loads.force_B_N + drag_force_B_N(m) + more.force_B_N;
  const Eigen::Vector3d moment_B_N_m = loads.moment_B_N_m + more.moment_B_N_m;
  Rate d;
  d.v_W_m_s = s.v_W_m_s;
  d.specific_force_B_m_s2 = force_B_N / config_.mass_kg;
  d.a_W_m_s2 = m.R_WB * d.specific_force_B_m_s2;
  d.a_W_m_s2.z() -= config_.gravity_m_s2;
  const Eigen::Quaterniond omega(0.0, s.w_B_rad_s.x(), s.w_B_rad_s.y(), s.w_B_rad_s.z());
  d.q_dot = 0.5 * (s.q_WB * omega).coeffs();
  d.w_dot_B_rad_s2 = inverse_inertia_ * (moment_B_N_m - s.w_B_rad_s.cross(config_.inertia_kg_m2 * s.w_B_rad_s));
  return d;
}

AirframeStatus Airframe::step(std::span<const RotorLoads, kAirframeRotors> loads, std::span<const double, kAirframeRotors> omega_rad_s,
                              std::span<const double, kAirframeRotors> omega_dot_rad_s2, const Air& air_at_body, const BodyLoads* further) {
  const std::int64_t end_ns = state_.time_ns + config_.step_ns;
  if (ended()) {
    state_.time_ns = end_ns;
    return status_;
  }
  const Loads now = sum_of_rotors(loads);
  bool inputs_finite = now.force_B_N.allFinite() && now.moment_B_N_m.allFinite();
  for (std::size_t i = 0; i < kAirframeRotors; ++i)
    inputs_finite = inputs_finite && std::isfinite(omega_rad_s[i]) && std::isfinite(omega_dot_rad_s2[i]);
  if (!inputs_finite) {
    state_.time_ns = end_ns;
    return status_ = AirframeStatus::diverged;
  }
  const RotorMomentum rotors = momentum(omega_rad_s, omega_dot_rad_s2);
  wrench_.rotor_force_B_N = now.force_B_N;
  wrench_.rotor_moment_B_N_m = now.moment_B_N_m;
  const BodyMotion start = motion_of(state_, air_at_body, rotors);
  wrench_.drag_force_B_N = drag_force_B_N(start);
  wrench_.further = {};
  if (further) further->add_to(wrench_.further, start);
  const Loads before = has_last_loads_ ? last_loads_ : now;
  last_loads_ = now;
  has_last_loads_ = true;

  if (state_.time_ns < release_ns_) {
    state_.time_ns = end_ns;
    return status_ = end_ns < release_ns_ ? AirframeStatus::clamped : AirframeStatus::flying;
  }

  // Loads continued linearly, rotors sped up by their mean acceleration.
  const double h = static_cast<double>(config_.step_ns) * 1e-9;
  AirframeState next = runge_kutta_step(state_, h, [&](const AirframeState& s, double x) {
    const Loads l{now.force_B_N + x * (now.force_B_N - before.force_B_N), now.moment_B_N_m + x * (now.moment_B_N_m - before.moment_B_N_m)};
    return rate(s, l, {rotors.H_B_N_m_s + (x * h) * rotors.H_dot_B_N_m, rotors.H_dot_B_N_m}, air_at_body, further);
  });
  next.time_ns = end_ns;
  if (!credible(next)) {
    state_.time_ns = end_ns;
    return status_ = AirframeStatus::diverged;
  }
  state_ = next;
  return status_ = state_.p_W_m.z() < config_.ground_z_m ? AirframeStatus::below_ground : AirframeStatus::flying;
}

}  // namespace rotorloop::sim
