// The phases of the commissioning that spin.
#include "firmware/core/commission/procedure.hpp"

namespace rotorloop::firmware {

// What the legs lose at this current while v_V is made. Turning, the ripple decides at which edges the dead time takes anything: the
// measured loss, over the modulator's own zone.
Stator CommissioningProcedure::lost_V(Stator current_A, Stator v_V) const {
  const ModulatorConfig& m = config_.modulator;
  const float lost = kDeadTimeTrust * result_.dead_time_s * board_.pwm_Hz * (v_.bus_V + 2.0f * board_.diode_drop_V);
  const float over_zone = 1.0f / (m.zone_A + m.ripple_A_V * (magnitude(v_V.a) + magnitude(v_V.b)));
  const Phases i = inverse_clarke(current_A);
  Phases by{};
  for (std::size_t k = 0; k < 3; ++k) by[k] = lost * clamp(i[k] * over_zone, -1.0f, 1.0f);
  return clarke(by);
}

// Back-EMF over the period that just ended, in a frame that stood at `angle` at its end.
Rotor CommissioningProcedure::back_emf_V(Angle angle, float omega_e_rad_s, Stator applied_V) const {
  const Rotation middle = rotation(angle - Angle::from_rad(0.5f * omega_e_rad_s * config_.period_s));
  const Stator mean_A = 0.5f * (v_.current_A + v_.last_A);
  const Rotor i = park(mean_A, middle), u = park(applied_V, middle);
  const float R = config_.observer.resistance_ohm, wL = omega_e_rad_s * result_.inductance_d_H;
  return {u.d - R * i.d + wL * i.q, u.q - R * i.q - wL * i.d};
}

void CommissioningProcedure::begin_ramp() {
  const float guess_rad_s = turn_share() * full_V() / v_.flux_Wb;
  const float torque_N_m = 1.5f * config_.pole_pairs * v_.flux_Wb * v_.largest_A;
  const float most_rad_s2 = 0.08f * config_.pole_pairs * torque_N_m / found_.inertia_kg_m2, wanted_rad_s2 = guess_rad_s * (1.0f / 1.5f);
  v_.turn_rad_s2 = wanted_rad_s2 < most_rad_s2 ? wanted_rad_s2 : most_rad_s2;
  v_.emf = {};
  v_.omega_e_rad_s = 0.0f;
}

void CommissioningProcedure::turn_open_loop() {
  const bool held = v_.phase == CommissioningPhase::speed_held;
  if (!held) v_.omega_e_rad_s += v_.turn_rad_s2 * config_.period_s;
  // At speed less is enough, and saturates less.
  hold_vector(v_.largest_A * (held && !v_.inject.noisy ? 1.0f - 0.5f * clamp(seconds() * (1.0f / 0.05f), 0.0f, 1.0f) : 1.0f), 0.5f);
  const Rotor emf = back_emf_V(v_.angle, v_.omega_e_rad_s, v_.duty_V - lost_V(0.5f * (v_.current_A + v_.last_A), v_.duty_V));
  v_.emf = v_.emf + (500.0f * config_.period_s) * (emf - v_.emf);
  const float emf_V = length(v_.emf);
  if (!held) {
    const float by_parameter_V = v_.omega_e_rad_s * v_.flux_Wb;
    if (emf_V > turn_share() * full_V() && by_parameter_V > 0.6f * turn_share() * full_V()) return go(CommissioningPhase::speed_held);
    if (v_.omega_e_rad_s * v_.flux_Wb > 3.0f * turn_share() * full_V()) finish(CommissioningEnd::does_not_turn);
    return;
  }
  result_.held_e_rad_s = v_.omega_e_rad_s;
  const float settle_s = 0.15f, window_s = 0.15f, t = seconds();
  if (t < settle_s) return;
  if (t < settle_s + window_s) {
    v_.sum_V += length(emf);
    v_.sum_count += 1.0f;
    return;
  }
  if (v_.order.wait_for_reference && v_.order.counted_rad_s <= 0.0f && t < 30.0f) return;
  result_.direction = v_.order.direction;
  if (v_.order.counted_rad_s > 0.0f) {
    result_.pole_pairs = pole_pairs_of(v_.omega_e_rad_s, v_.order.counted_rad_s);
    if (result_.pole_pairs == 0) return finish(CommissioningEnd::counted_speed_inconsistent);
  }
  take_to_observer(v_.sum_V / v_.sum_count / v_.omega_e_rad_s);
}

void CommissioningProcedure::set_flux(float flux_Wb) {
  v_.flux_Wb = flux_Wb;
  config_.observer.flux_linkage_Wb = config_.current.flux_linkage_Wb = flux_Wb;
  config_.observer.over_flux = 1.0f / flux_Wb;
}

// The same currents and voltages in the observer's frame, which starts where the back-EMF says that the magnet is.
void CommissioningProcedure::take_to_observer(float flux_Wb) {
  if (!kPlausibleFlux.holds(flux_Wb)) return finish(CommissioningEnd::does_not_turn);
  set_flux(flux_Wb);
  v_.sum_V = v_.sum_count = 0.0f;
  const float over_emf = 1.0f / length(v_.emf);
  const Rotation load{v_.emf.q * over_emf, -v_.emf.d * over_emf};  // from the vector's frame to the magnet's: a quarter behind the EMF
  const Rotation magnet = rotation(v_.angle) * load;
  ObserverState& o = v_.observer;
  o = {};
  o.magnet_flux_Wb = {flux_Wb * magnet.cos, flux_Wb * magnet.sin};
  o.last_current_A = v_.current_A;
  o.stator_flux_Wb = o.magnet_flux_Wb + config_.observer.inductance_H * v_.current_A;
  o.angle = v_.angle + small_angle(load);
  o.omega_e_rad_s = o.speed_e_rad_s = v_.omega_e_rad_s;
  o.lock = o.flux_ratio = 1.0f;
  // It is locked: nothing to look for.
  config_.observer.search_rate = 0.0f;
  // A motor whose current is hardly more than noise turns slowly: narrow.
  if (v_.inject.noisy) config_.observer.pll_search_rad_s = 0.3f * config_.observer.pll_run_rad_s;
  const Rotation by = conjugate(rotation(o.angle - v_.angle));
  v_.current.integral_V = by * v_.current.integral_V - Rotor{0.0f, v_.omega_e_rad_s * flux_Wb};
  v_.from_A = by * v_.seen_A;
  // As much as there is, since what the dead time hides counts for less then; a board that hardly sees the current needs time instead.
  const float least_s = v_.inject.noisy ? 0.03f : 0.01f;
  const float wanted_rad_s2 = (kTopShare - turn_share()) * full_V() / (flux_Wb * pole_pairs() * least_s);
  const float wanted_A = wanted_rad_s2 * found_.inertia_kg_m2 / (1.5f * pole_pairs() * flux_Wb) + 0.15f * v_.largest_A;
  v_.accelerate_A = wanted_A < v_.largest_A ? wanted_A : v_.largest_A;
  v_.idle_A = 0.5f * v_.largest_A;
  begin_run();
}

// Of a rotation by less than a right angle; 0.02 rad off at 1 rad, which the phase-locked loop takes out.
Angle CommissioningProcedure::small_angle(Rotation r) {
  const float s = clamp(r.sin, -0.9f, 0.9f);
  return Angle::from_rad(s * (1.0f + s * s * (1.0f / 6.0f + s * s * (3.0f / 40.0f))));
}

void CommissioningProcedure::begin_run() {
  v_.spin = {};
  v_.spin.current_A = v_.accelerate_A;
  v_.spin.speed_rad_s = kTopShare * full_V() / (v_.flux_Wb * pole_pairs());
  v_.best_rad_s2 = v_.mean_rad_s2 = 0.0f;
  v_.block_s = v_.block_rad = 0.0f;
  v_.block_angle = v_.observer.angle;
  v_.block_rad_s = v_.observer.omega_e_rad_s / pole_pairs();
  go(CommissioningPhase::accelerate);
}

void CommissioningProcedure::turn_observed() {
  const bool coasting = v_.phase == CommissioningPhase::coast;
  const float T = config_.period_s, t = seconds();
  const Stator mean_A = 0.5f * (v_.current_A + v_.last_A);
  const Stator applied_V = v_.duty_V - lost_V(mean_A, v_.duty_V);
  step(config_.observer, v_.observer, applied_V, v_.current_A, config_.observer.resistance_ohm, 0.0f, false);
  const ObserverState& o = v_.observer;
  const Rotation at = rotation(o.angle);
  const FrameMotion frame = frame_motion(o.omega_e_rad_s, T);
  v_.seen_A = park(v_.current_A, at);
  // Coasting with a current along the magnet: no torque, but phases far enough from zero for the dead time to be known. Once against the
  // magnet and once with it, so that the inductance drops out of the flux.
  const Rotor goal = coasting ? Rotor{v_.with_magnet ? v_.idle_A : -v_.idle_A, 0.0f} : Rotor{0.0f, v_.accelerate_A};
  const float share = clamp(t * (1.0f / kBlend_s), 0.0f, 1.0f);
  v_.wanted_A = v_.from_A + share * (goal - v_.from_A);
  const CurrentLoopStep loop =
      step(config_.current, v_.current, v_.wanted_A, v_.seen_A, frame, true, voltage_limit_V(config_.modulator, v_.bus_V));
  const Rotation ahead = at * (frame.full * frame.half);
  v_.command_V = inverse_park(loop.v_V, ahead);
  v_.command_V = v_.command_V + lost_V(inverse_park(v_.seen_A, ahead), v_.command_V);
  if (o.lock < 0.7f) return finish(CommissioningEnd::observer_lost);
  record(coasting && t > 1.5f * kBlend_s, applied_V);
  if (coasting)
    end_coast();
  else
    end_acceleration();
}

void CommissioningProcedure::record(bool idle, Stator applied_V) {
  const float T = config_.period_s, w = v_.observer.omega_e_rad_s / pole_pairs();
  const float turned_rad = (v_.observer.angle - v_.block_angle).rad();
  v_.block_angle = v_.observer.angle;
  if (idle) {
    const std::size_t way = v_.with_magnet ? 1 : 0;
    v_.spin.emf_V[way] += back_emf_V(v_.observer.angle, v_.observer.omega_e_rad_s, applied_V).q * T;
    v_.spin.emf_rad_s[way] += turned_rad;
  }
  // Torque by saliency while the first current fades.
  if (v_.phase == CommissioningPhase::accelerate && v_.run == 0 && v_.cycle == 0 && seconds() < 1.5f * kBlend_s) return;
  integrate(v_.spin, v_.seen_A.q, w, T);
  v_.block_s += T;
  v_.block_rad += turned_rad;
  if (v_.block_s < kBlock_s) return;
  // The mean speed by the angle turned: unlike the loop's own speed it does not lag behind an acceleration.
  const float mean_rad_s = v_.block_rad / (v_.block_s * pole_pairs());
  add_speed(v_.spin, mean_rad_s);
  v_.mean_rad_s2 += 0.2f * ((mean_rad_s - v_.block_rad_s) / v_.block_s - v_.mean_rad_s2);
  v_.block_rad_s = mean_rad_s;
  v_.block_s = v_.block_rad = 0.0f;
  if (v_.spin.sums.rows > 10 && v_.mean_rad_s2 > v_.best_rad_s2) v_.best_rad_s2 = v_.mean_rad_s2;
}

void CommissioningProcedure::end_acceleration() {
  const float emf_V = v_.observer.omega_e_rad_s * v_.flux_Wb, t = seconds();
  const float fastest = 0.95f * found_.max_speed_rad_s * config_.pole_pairs;
  const bool fast = emf_V > kTopShare * full_V() || v_.observer.omega_e_rad_s > fastest;
  const bool exhausted = t > 0.1f && v_.mean_rad_s2 < 0.25f * v_.best_rad_s2;
  if (!fast && !exhausted && t < 3.0f) return;
  v_.from_A = v_.wanted_A;
  v_.with_magnet = false;
  v_.top_V = emf_V;
  go(CommissioningPhase::coast);
}

void CommissioningProcedure::end_coast() {
  const float emf_V = v_.observer.omega_e_rad_s * v_.flux_Wb, t = seconds();
  const float low_V = 1.1f * turn_share() * full_V(), half_V = 0.5f * (low_V + v_.top_V);
  if (t < 0.07f || (emf_V > (v_.with_magnet ? low_V : half_V) && t < 1.0f)) return;
  if (!v_.with_magnet) {
    v_.with_magnet = true;
    v_.from_A = v_.wanted_A;
    return go(CommissioningPhase::coast);
  }
  v_.from_A = v_.wanted_A;
  // Noise asks for more of the same before it is solved.
  if (++v_.cycle < (v_.inject.noisy ? 3u : 1u)) return go(CommissioningPhase::accelerate);
  v_.cycle = 0;
  v_.spins[v_.run] = solve(v_.spin, pole_pairs());
  if (!kPlausibleFlux.holds(v_.spins[v_.run].flux_linkage_Wb)) return finish(CommissioningEnd::flux_range);
  set_flux(v_.spins[v_.run].flux_linkage_Wb);
  if (++v_.run < v_.spins.size()) return begin_run();
  conclude_spin();
}

void CommissioningProcedure::conclude_spin() {
  const SpinResult &one = v_.spins[0], &two = v_.spins[1];
  result_.flux_linkage_Wb = 0.5f * (one.flux_linkage_Wb + two.flux_linkage_Wb);
  result_.inertia_kg_m2 = 0.5f * (one.inertia_kg_m2 + two.inertia_kg_m2);
  result_.friction_N_m = 0.5f * (one.friction_N_m + two.friction_N_m);
  const float load = 0.5f * (one.load_N_m_s2 + two.load_N_m_s2);
  result_.load_N_m_s2 = load > 0.0f ? load : 0.0f;
  const CommissioningEnd end = judge_spin(one, two, v_.order, pole_pairs());
  result_.spin_valid = end == CommissioningEnd::none;
  finish(end == CommissioningEnd::none ? CommissioningEnd::done : end);
}

}  // namespace rotorloop::firmware
