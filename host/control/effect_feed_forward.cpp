#include "host/control/effect_feed_forward.hpp"

#include <algorithm>
#include <cmath>

#include "host/vehicle/drag.hpp"
#include "host/vehicle/thrust.hpp"

namespace rotorloop::host {

namespace {

constexpr std::string_view kLocalInflow = "rotor_local_inflow";

Vec3<double> vec3(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

LoadInput<double> load_input(const EffectMotion& m, const std::array<double, kRotors>& omega_rad_s) {
  LoadInput<double> in;
  in.v_B_m_s = vec3(m.v_B_m_s);
  in.rates_B_rad_s = vec3(m.w_B_rad_s);
  for (int axis = 0; axis < 3; ++axis) in.world_B[static_cast<std::size_t>(axis)] = vec3(m.R_WB.row(axis).transpose());
  in.p_W_m = vec3(m.p_W_m);
  in.omega_rad_s = omega_rad_s;
  in.t_s = m.t_s;
  return in;
}

bool cut(double& value, double limit) {
  const double kept = std::clamp(value, -limit, limit);
  const bool was_cut = kept != value;
  value = kept;
  return was_cut;
}

}  // namespace

EffectFeedForward::EffectFeedForward(const VehicleModel& vehicle, const VehicleTerms& terms, const MixerConfig& mixer)
    : geometry_(load_geometry(vehicle)), parameters_(load_parameters(vehicle)), drag_(vehicle.drag), weight_N_(vehicle.weight_N()) {
  if (terms.empty()) return;
  // The mixer lets each rotor see its own place in the air. A file that says nothing about it does not take that away.
  bool named = false;
  for (std::size_t i = 0; i < terms.list.size(); ++i) named |= terms.list.term(i).info.id == kLocalInflow;
  const double whole = 1.0;
  const Term* local = named || !mixer.local_velocity ? nullptr : find_term(kLocalInflow);
  if (local) terms_.add(*local, {&whole, 1});
  for (std::size_t i = 0; i < terms.list.size(); ++i) {
    const Term& term = terms.list.term(i);
    terms_.add(term, {terms.values.data() + terms.list.first_parameter(i), term.info.parameters.size()});
  }
  const double hover = hover_omega_rad_s(vehicle);
  for (int i = 0; i < kRotors; ++i) {
    const Eigen::Vector3d arm = vehicle.arm_m(i);
    torque_scale_N_m_.x() += std::fabs(arm.y()) * weight_N_ / kRotors;
    torque_scale_N_m_.y() += std::fabs(arm.x()) * weight_N_ / kRotors;
    torque_scale_N_m_.z() += vehicle.c_q_N_m_s2 * hover * hover;
  }
}

EffectLoad EffectFeedForward::load(const Mixer& mixer, const EffectMotion& motion, const std::array<double, kRotors>& omega_rad_s) const {
  const LoadInput<double> in = load_input(motion, omega_rad_s);
  LoadState<double> s{in, parameters_, geometry_, {}, {}, {}, {}, {}, {}, {}};
  const TermSet<double> set(terms_.list, terms_.values.data());
  loads(s, &set);

  const MixerWrench nominal = mixer.wrench(omega_rad_s, motion.v_B_m_s, motion.w_B_rad_s);
  const Eigen::Vector3d drag =
      airframe_drag_B_N(drag_, motion.v_B_m_s) + rotor_drag_B_N(drag_, std::max(0.0, nominal.thrust_N), motion.v_B_m_s);
  EffectLoad out;
  out.force_B_N = eigen(s.force_B_N) - Eigen::Vector3d(0.0, 0.0, s.thrust_sum_N) - drag;
  out.thrust_N = nominal.thrust_N - s.thrust_sum_N;
  out.torque_B_N_m = nominal.torque_B_N_m - eigen(s.torque_B_N_m);
  if (!out.force_B_N.allFinite() || !std::isfinite(out.thrust_N) || !out.torque_B_N_m.allFinite()) {
    out = {};
    out.finite = false;
    return out;
  }
  const double force_max = kEffectShare * weight_N_;
  for (int axis = 0; axis < 3; ++axis) {
    out.bounded |= cut(out.force_B_N[axis], force_max);
    out.bounded |= cut(out.torque_B_N_m[axis], kEffectShare * torque_scale_N_m_[axis]);
  }
  out.bounded |= cut(out.thrust_N, force_max);
  return out;
}

EffectFeedForward::Mixed EffectFeedForward::solve(const Mixer& mixer, const MixerDemand& demand, const EffectMotion& motion,
                                                  const EffectLoad& at_guess, const std::array<double, kRotors>& guess_rad_s) const {
  Mixed out;
  out.at_result = at_guess;
  std::array<double, kRotors> guess = guess_rad_s;
  int iterations = 0;
  while (!out.converged && out.rounds < kMaxRounds) {
    ++out.rounds;
    const EffectLoad used = out.at_result;
    MixerDemand raised = demand;
    raised.thrust_N += used.thrust_N;
    raised.torque_B_N_m += used.torque_B_N_m;
    out.result = mixer.solve(raised, guess);
    iterations += out.result.iterations;
    guess = out.result.omega_rad_s;
    out.at_result = load(mixer, motion, guess);
    out.converged = std::fabs(out.at_result.thrust_N - used.thrust_N) <= kThrustTolerance * weight_N_ &&
                    ((out.at_result.torque_B_N_m - used.torque_B_N_m).array().abs() <= kTorqueTolerance * torque_scale_N_m_.array()).all();
  }
  out.result.iterations = iterations;
  return out;
}

}  // namespace rotorloop::host
