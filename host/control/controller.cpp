#include "host/control/controller.hpp"

#include <algorithm>
#include <cmath>

#include "host/base/elementary.hpp"
#include "host/vehicle/drag.hpp"

namespace rotorloop::host {

namespace {

bool finite(const Setpoint& s) {
  return s.p_W_m.allFinite() && s.v_W_m_s.allFinite() && s.a_W_m_s2.allFinite() && s.j_W_m_s3.allFinite() && std::isfinite(s.yaw_rad) &&
         std::isfinite(s.yaw_rate_rad_s);
}

bool finite(const StateEstimate& e) {
  return e.p_W_m.allFinite() && e.v_W_m_s.allFinite() && e.w_B_rad_s.allFinite() && e.q_WB.coeffs().allFinite() &&
         e.q_WB.squaredNorm() > 0.5 && e.q_WB.squaredNorm() < 2.0;
}

// Finite numbers whose squares overflow are no better than infinities.
constexpr double kSane = 1e6;
bool sane(const StateEstimate& e, const Setpoint& s) {
  const auto small = [](const Eigen::Vector3d& v) { return v.cwiseAbs().maxCoeff() < kSane; };
  return small(e.p_W_m) && small(e.v_W_m_s) && small(e.w_B_rad_s) && small(s.p_W_m) && small(s.v_W_m_s) && small(s.a_W_m_s2) &&
         small(s.j_W_m_s3) && std::fabs(s.yaw_rad) < kSane && std::fabs(s.yaw_rate_rad_s) < kSane;
}

MixerConfig mixer_config(const ControllerConfig& c) {
  const bool solved = c.variant == Variant::pd_ff_thrust_drag || c.variant == Variant::pd_ff_no_effects;
  return {.lookup = solved ? c.thrust_lookup : ThrustLookup::still_air,
          .local_velocity = c.rotor_local_velocity,
          .omega_min_rad_s = c.omega_min_rad_s,
          .omega_max_rad_s = c.omega_max_rad_s};
}

// How slowly the propellers' part of the yaw torque may follow, because the rotors' inertia gives its part ahead of it.
double yaw_shaping(const VehicleModel& vehicle, const ControllerConfig& config, double hover_rad_s) {
  if (!config.rotor_reaction) return 0.0;
  return std::min(vehicle.rotor_inertia_kg_m2 / (2.0 * vehicle.c_q_N_m_s2 * hover_rad_s), kYawShapingMax_s);
}

double yaw_of(const Eigen::Matrix3d& R) { return atan2_exact(R(1, 0), R(0, 0)); }

// Position and velocity drift away on the IMU alone: stop using them, stay level, keep the heading.
void stay_level(double yaw_rad, StateEstimate& estimate, Setpoint& setpoint) {
  setpoint = Setpoint{};
  setpoint.yaw_rad = yaw_rad;
  estimate.p_W_m.setZero();
  estimate.v_W_m_s.setZero();
}

// What turns the error into the angular acceleration against it.
Eigen::Vector3d wanted_acceleration(const Gains& k, const AttitudeError& error) {
  const Eigen::Vector3d kp(k.roll_pitch.kp(), k.roll_pitch.kp(), k.yaw.kp());
  const Eigen::Vector3d kd(k.roll_pitch.kd(), k.roll_pitch.kd(), k.yaw.kd());
  return kp.cwiseProduct(error.angle_rad) + kd.cwiseProduct(error.rate_rad_s);
}

void note(const EffectLoad& effect, const EffectFeedForward::Mixed& mixed, Diagnostics& d, ControllerCounters& counters) {
  d.effect_thrust_N = mixed.at_result.thrust_N;
  d.effect_rounds = mixed.rounds;
  counters.effects_not_finite += !effect.finite || !mixed.at_result.finite;
  counters.effects_bounded += effect.bounded || mixed.at_result.bounded;
  counters.effects_not_converged += !mixed.converged;
}

void note(const MixerResult& mixed, Diagnostics& d, ControllerCounters& counters) {
  d.mixer_iterations = mixed.iterations;
  d.mixer_residual_rad_s = mixed.residual_rad_s;
  d.limiters.yaw = mixed.yaw_limited;
  d.limiters.thrust |= mixed.thrust_limited;
  d.limiters.roll_pitch = mixed.torque_limited;
  d.limiters.table_edge = mixed.table_edge;
  counters.mixer_not_converged += mixed.residual_rad_s > Mixer::kConverged_rad_s;
  counters.limited += d.limiters != Limiters{};
}

}  // namespace

std::string_view name(Variant variant) {
  switch (variant) {
    case Variant::pd_ff:
      return "pd_ff";
    case Variant::pd_ff_drag:
      return "pd_ff_drag";
    case Variant::pd_ff_thrust_drag:
      return "pd_ff_thrust_drag";
    case Variant::pd_ff_no_effects:
      return "pd_ff_no_effects";
  }
  return "unknown";
}

bool parse(std::string_view word, Variant& variant) {
  for (const Variant v : {Variant::pd_ff, Variant::pd_ff_drag, Variant::pd_ff_no_effects, Variant::pd_ff_thrust_drag})
    if (name(v) == word) {
      variant = v;
      return true;
    }
  return false;
}

Controller::Controller(const VehicleModel& vehicle, const ControllerConfig& config)
    : vehicle_(vehicle),
      config_(config),
      mixer_(vehicle, mixer_config(config)),
      effects_(vehicle, config.variant == Variant::pd_ff_thrust_drag ? config.terms : VehicleTerms{}, mixer_config(config)),
      yaw_shaping_s_(yaw_shaping(vehicle, config, mixer_.hover_omega_rad_s())) {}

// Eq. (9), then the limits: the vertical part is kept and the horizontal part shortened, so that height is the last to suffer.
Eigen::Vector3d Controller::wanted_thrust_W_N(const StateEstimate& estimate, const Setpoint& setpoint,
                                              const Eigen::Vector3d& effect_force_B_N, Limiters& limiters) const {
  const Gains& k = config_.gains;
  const Eigen::Vector3d kp(k.horizontal.kp(), k.horizontal.kp(), k.vertical.kp());
  const Eigen::Vector3d kd(k.horizontal.kd(), k.horizontal.kd(), k.vertical.kd());
  const Eigen::Vector3d e_p = estimate.p_W_m - setpoint.p_W_m, e_v = estimate.v_W_m_s - setpoint.v_W_m_s;
  Eigen::Vector3d thrust = vehicle_.mass_kg * (setpoint.a_W_m_s2 - kp.cwiseProduct(e_p) - kd.cwiseProduct(e_v));
  thrust.z() += vehicle_.weight_N();

  if (config_.variant != Variant::pd_ff) {
    const Eigen::Matrix3d R_WB = estimate.q_WB.toRotationMatrix();
    const Eigen::Vector3d v_B = R_WB.transpose() * (config_.drag_velocity == DragVelocity::setpoint ? setpoint.v_W_m_s : estimate.v_W_m_s);
    const double carried_N = std::max(0.0, thrust.dot(R_WB.col(2)));  // ΣT of eq. (4)
    thrust -= R_WB * (airframe_drag_B_N(vehicle_.drag, v_B) + rotor_drag_B_N(vehicle_.drag, carried_N, v_B) + effect_force_B_N);
  }

  const double weight = vehicle_.weight_N(), total_max = config_.limits.total_max_weight * weight;
  const double vertical = std::clamp(thrust.z(), config_.limits.vertical_min_weight * weight, total_max);
  limiters.thrust |= vertical != thrust.z();
  thrust.z() = vertical;
  const double horizontal = std::sqrt(thrust.x() * thrust.x() + thrust.y() * thrust.y());
  const SinCos tilt = sincos_exact(config_.limits.tilt_max_rad);
  const double by_tilt = vertical * tilt.sin / tilt.cos, by_total = std::sqrt(std::max(total_max * total_max - vertical * vertical, 0.0));
  const double allowed = std::min(by_tilt, by_total);
  if (horizontal > allowed) {
    (by_tilt < by_total ? limiters.tilt : limiters.thrust) = true;
    thrust.head<2>() *= allowed / horizontal;
  }
  return thrust;
}

void Controller::begin(ControllerState& state) const {
  ++state.counters.steps;
  if (!state.started) state.omega_rad_s.fill(std::clamp(mixer_.hover_omega_rad_s(), config_.omega_min_rad_s, config_.omega_max_rad_s));
}

void Controller::repeat_last(ControllerState& state, Command& out) const {
  ++state.counters.bad_input;
  out.diagnostics.bad_input = true;
  out.omega_rad_s = state.omega_rad_s;
}

void Controller::shape_torque(ControllerState& state, const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& w_B_rad_s,
                              const AttitudeSetpoint& attitude, Diagnostics& d) const {
  d.torque_B_N_m = -vehicle_.inertia_kg_m2.cwiseProduct(wanted_acceleration(config_.gains, attitude_error(R_WB, w_B_rad_s, attitude)));
  // A change of speed gives its reaction J dω/dt at once, far more than the drag it leads to: soften the demand.
  state.yaw_torque_N_m += config_.period_s / (yaw_shaping_s_ + config_.period_s) * (d.torque_B_N_m.z() - state.yaw_torque_N_m);
}

Command Controller::follow(ControllerState& state, const StateEstimate& estimate, const AttitudeDemand& wanted) const {
  Command out;
  Diagnostics& d = out.diagnostics;
  begin(state);
  const double q2 = wanted.q_WB.squaredNorm();
  const bool good = std::isfinite(q2) && q2 > 0.5 && q2 < 2.0 && wanted.w_B_rad_s.allFinite() && std::isfinite(wanted.thrust_B_N);
  if (!good || !finite(estimate) || !sane(estimate, Setpoint{})) {
    repeat_last(state, out);
    return out;
  }
  StateEstimate used = estimate;
  used.q_WB.normalize();
  const Eigen::Matrix3d R_WB = used.q_WB.toRotationMatrix();
  d.q_WB_sp = wanted.q_WB.normalized();
  d.w_B_sp_rad_s = wanted.w_B_rad_s;
  const AttitudeSetpoint attitude{.R_WB = d.q_WB_sp.toRotationMatrix(), .w_B_rad_s = wanted.w_B_rad_s};
  shape_torque(state, R_WB, used.w_B_rad_s, attitude, d);
  d.thrust_B_N = std::clamp(wanted.thrust_B_N, 0.0, config_.limits.total_max_weight * vehicle_.weight_N());
  d.limiters.thrust = d.thrust_B_N != wanted.thrust_B_N;
  d.thrust_W_N = attitude.R_WB.col(2) * d.thrust_B_N;
  const Eigen::Vector3d v_W_m_s = estimate.valid ? used.v_W_m_s : Eigen::Vector3d::Zero();
  const MixerResult mixed = mixer_.solve({.thrust_N = d.thrust_B_N,
                                          .torque_B_N_m = {d.torque_B_N_m.x(), d.torque_B_N_m.y(), state.yaw_torque_N_m},
                                          .v_B_m_s = R_WB.transpose() * v_W_m_s,
                                          .w_B_rad_s = used.w_B_rad_s},
                                         state.omega_rad_s);
  note(mixed, d, state.counters);
  out.omega_rad_s = state.omega_rad_s = mixed.omega_rad_s;
  state.started = true;
  return out;
}

Command Controller::step(ControllerState& state, const StateEstimate& estimate, const Setpoint& wanted) const {
  Command out;
  Diagnostics& d = out.diagnostics;
  begin(state);
  if (!finite(estimate) || !finite(wanted) || !sane(estimate, wanted)) {
    repeat_last(state, out);
    return out;
  }

  const Eigen::Matrix3d R_WB = estimate.q_WB.normalized().toRotationMatrix();
  Setpoint setpoint = wanted;
  StateEstimate used = estimate;
  used.q_WB.normalize();
  if (!estimate.valid) {
    ++state.counters.estimate_invalid;
    d.estimate_invalid = true;
    stay_level(yaw_of(R_WB), used, setpoint);
  }

  const EffectMotion motion{.R_WB = R_WB,
                            .p_W_m = used.p_W_m,
                            .v_B_m_s = R_WB.transpose() * used.v_W_m_s,
                            .w_B_rad_s = used.w_B_rad_s,
                            .t_s = 1e-6 * static_cast<double>(estimate.time_us)};
  const bool with_effects = effects_.any() && estimate.valid;  // without place and velocity the terms know nothing
  state.counters.effects_off += effects_.any() && !estimate.valid;
  const EffectLoad effect = with_effects ? effects_.load(mixer_, motion, state.omega_rad_s) : EffectLoad{};
  d.effect_force_B_N = effect.force_B_N;
  d.thrust_W_N = wanted_thrust_W_N(used, setpoint, effect.force_B_N, d.limiters);
  const AttitudeSetpoint attitude =
      flat_attitude(d.thrust_W_N / vehicle_.mass_kg, setpoint.j_W_m_s3, setpoint.yaw_rad, setpoint.yaw_rate_rad_s, state.heading);
  d.limiters.direction_held = attitude.direction_held;
  d.q_WB_sp = Eigen::Quaterniond(attitude.R_WB);
  d.w_B_sp_rad_s = attitude.w_B_rad_s;

  shape_torque(state, R_WB, used.w_B_rad_s, attitude, d);
  // The part of the wanted thrust along the present axis: while the attitude catches up the rest would push sideways.
  d.thrust_B_N = std::max(0.0, d.thrust_W_N.dot(R_WB.col(2)));
  const MixerDemand demand{.thrust_N = d.thrust_B_N,
                           .torque_B_N_m = {d.torque_B_N_m.x(), d.torque_B_N_m.y(), state.yaw_torque_N_m},
                           .v_B_m_s = motion.v_B_m_s,
                           .w_B_rad_s = motion.w_B_rad_s};
  MixerResult mixed;
  if (with_effects) {
    const EffectFeedForward::Mixed whole = effects_.solve(mixer_, demand, motion, effect, state.omega_rad_s);
    mixed = whole.result;
    note(effect, whole, d, state.counters);
  } else {
    mixed = mixer_.solve(demand, state.omega_rad_s);
  }
  note(mixed, d, state.counters);
  out.omega_rad_s = state.omega_rad_s = mixed.omega_rad_s;
  state.started = true;
  return out;
}

}  // namespace rotorloop::host
