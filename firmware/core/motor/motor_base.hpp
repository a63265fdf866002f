// The part of the motor control that knows no board: what the main loop sees, the orders, the current control, and the jobs of the
// slots that only compute. motor.hpp adds the interrupt and whatever opens and closes the bridge.
#pragma once
#include <cmath>

#include "firmware/core/motor/mailbox.hpp"
#include "firmware/core/motor/trip_log.hpp"
#include "firmware/core/motor/variables.hpp"

namespace rotorloop::firmware {

class MotorBase {
 public:
  MotorBase(const MotorConfig& config, const SelfTestConfig& self_test) : config_(config), self_test_config_(self_test) {
    v_.resistance_ohm = config_.observer.resistance_ohm;
    v_.dead_share = v_.known_dead_share = config_.dead_time.unknown_share;
    if (self_test_config_.wanted) self_test_.result = SelfTest::due;
    publish();
  }

  // From the main loop, again and again: what is not renewed within kOrderLife_s is no longer followed. A value that is no number
  // renews nothing and is counted.
  void set_setpoint(const Setpoint& s) {
    if (std::isfinite(s.value))
      orders_.write(s);
    else
      __atomic_fetch_add(&refused_, 1u, __ATOMIC_RELAXED);
  }

  // Whole, whenever it is asked for: as the last round of slots, or the last trip, left it.
  Telemetry telemetry() const {
    Telemetry t = telemetry_.read();
    t.error_count += __atomic_load_n(&refused_, __ATOMIC_RELAXED);
    // Bytes that stand still for as long as the motor is driven; what is broken was written before the result.
    t.self_test.result = self_test_.result;
    if (t.self_test.result == SelfTest::failed) {
      t.self_test.broken = self_test_.broken;
      t.self_test.leg = self_test_.leg & 3u;
    }
    return t;
  }
  const TripLog& trips() const { return trips_; }
  std::uint32_t setpoints_refused() const { return __atomic_load_n(&refused_, __ATOMIC_RELAXED); }
  ParameterProblem problem() const { return config_.problem; }
  bool calibrated() const { return v_.sense.calibrated; }

  const MotorVariables& variables() const { return v_; }
  Counters counters() const {
    Counters c = v_.counters;
    c.setpoints_refused = setpoints_refused();
    return c;
  }
  const MotorConfig& config() const { return config_; }
  MotorConfig& config() { return config_; }  // tests that switch one protection off to show what it prevents

 protected:
  float speed_rad_s() const { return v_.observer.speed_e_rad_s * config_.over_pole_pairs; }
  float frame_speed_rad_s() const { return v_.observer.omega_e_rad_s * config_.over_pole_pairs; }
  bool observing() const { return v_.state == MotorState::running || v_.state == MotorState::handover || v_.state == MotorState::stopping; }
  bool driving() const { return v_.state != MotorState::off && v_.state != MotorState::fault; }
  bool shorted() const { return v_.state == MotorState::braking || v_.state == MotorState::holding || v_.start.shorted; }
  bool starting() const { return v_.state == MotorState::catching || v_.state == MotorState::align || v_.state == MotorState::ramp; }

  // Electrical acceleration from the firmware's model of the torque; only when the frame is the rotor's.
  float torque_rad_s2() const {
    if (!observing()) return 0.0f;
    const float w_e = v_.observer.speed_e_rad_s;
    return config_.rad_s2_A * v_.measured_A.q - config_.load_e_1_rad * w_e * magnitude(w_e);
  }

  void control_current(const FrameMotion& frame, float bus_V) {
    const CurrentLoopStep loop =
        step(config_.current, v_.current, v_.wanted_A, v_.measured_A, frame, !v_.own_frame, voltage_limit_V(config_.modulator, bus_V));
    v_.given_V = shorted() ? Rotor{} : loop.v_V;
    v_.across_V += config_.across_filter * (loop.v_V.q - v_.resistance_ohm * v_.measured_A.q - v_.across_V);
    v_.limited_samples += loop.limited ? 1u : 0u;
    if (!driving() || shorted()) v_.current = {};
  }

  // A round of slots that took longer than it may: the interrupt came late or not at all, as while flash is written.
  void watch_time(std::uint64_t now_us) {
    if (v_.round_us != 0 && now_us - v_.round_us > config_.late_us) ++v_.counters.interrupts_late;
    v_.round_us = now_us;
  }

  void take_order() {
    const std::uint32_t sequence = orders_.sequence();
    v_.order_age = sequence != v_.order_sequence ? 0 : v_.order_age < config_.order_ticks ? v_.order_age + 1 : v_.order_age;
    v_.order_sequence = sequence;
    if (v_.order_age < config_.order_ticks) {
      v_.order = orders_.read();
    } else if (v_.order.mode != Mode::off) {
      v_.order = {};
      ++v_.counters.orders_expired;
    }
  }

  bool fresh() const { return v_.order_age < config_.order_ticks && v_.order_sequence != 0; }

  bool wants_motion() const {
    return (v_.order.mode == Mode::speed && v_.order.value != 0.0f) || (v_.order.mode == Mode::duty && magnitude(v_.order.value) > 0.02f) ||
           (v_.order.mode == Mode::current && magnitude(v_.order.value) > 0.1f);
  }

  // Asked only while nothing is driven, which is when a zero can be found out of tolerance.
  [[gnu::noinline]] Blocked why_not() {
    ProtectionState& p = v_.protection;
    if (v_.sense.zero_out_of_tolerance && p.fault != Fault::sensor) {
      p.fault = Fault::sensor;
      p.latched = true;
      ++v_.counters.calibration_failures;
      v_.state = MotorState::fault;
    }
    if (config_.problem != ParameterProblem::none) return Blocked::parameters;
    SelfTestVariables& test = self_test_;
    if (test.result == SelfTest::failed) return Blocked::broken;
    if (test.wait > 0 && --test.wait == 0) test.result = SelfTest::due;  // the rotor turned
    if (v_.sense.zero_out_of_tolerance) return Blocked::current_sensor;
    if (!v_.sense.calibrated) return Blocked::calibrating;
    const Blocked by = blocked_by(config_.protection, v_.protection, v_.bus_V, v_.temperature_K);
    if (by != Blocked::none) return by;
    if (test.result == SelfTest::due) return Blocked::self_test;
    if (!fresh()) return Blocked::stale_order;
    return wants_motion() || v_.order.mode == Mode::tone ? Blocked::none : Blocked::no_order;
  }

  // Running well for a second forgives earlier faults.
  void forgive() {
    ProtectionState& p = v_.protection;
    if (p.healthy_ticks < config_.protection.healthy_ticks)
      ++p.healthy_ticks;
    else {
      p.restarts = p.trying_ticks = 0;
      p.fault = Fault::none;
    }
  }

  void enter_phase(MotorState state) {
    v_.state = state;
    v_.phase_s = 0.0f;
    v_.wanted_A = {};
  }

  // Voltage lost along the start vector per voltage lost by a phase: 4/3 when all current lies along it.
  float lost_along() const {
    const Stator lost_V = v_.active.lost_V;
    const float phase_V = v_.dead_share * (v_.bus_V + 2.0f * config_.modulator.diode_drop_V);
    return phase_V > 0.0f ? park(lost_V, rotation(v_.own_angle)).d / phase_V : 0.0f;
  }

  void learn_at_rest(const StartStep& s) {
    if (s.resistance_ohm < config_.resistance.least_ohm || s.resistance_ohm > config_.resistance.most_ohm) {
      ++v_.counters.resistance_refused;
      v_.dead_share = v_.known_dead_share;
      return;
    }
    v_.resistance_ohm = s.resistance_ohm;
    v_.resistance_measured = true;
    remember_cold(config_.health, v_.health, s.resistance_ohm, v_.temperature_K);
    const float share = kDeadTimeTrust * (v_.dead_share + s.lost_V / (v_.bus_V + 2.0f * config_.modulator.diode_drop_V));
    v_.dead_share = v_.known_dead_share = clamp(share, config_.dead_time.least_share, config_.dead_time.most_share);
  }

  void take_over(float current_q_A) {
    v_.own_frame = false;
    v_.start.phase = MotorState::off;
    v_.start.shorted = false;
    v_.state = MotorState::handover;
    v_.phase_s = 0.0f;
    v_.direction = sign_of(v_.observer.omega_e_rad_s);
    v_.wanted_A = {v_.hold_A, current_q_A};
    v_.learning = {v_.observer.flux_ratio, 0.0f};
    enter(config_.speed, v_.speed, speed_rad_s(), current_q_A);
  }

  // What the EMF of the rotor that was found will be, on average, over the period after the next sample, less what was too much of it.
  PwmCompare oppose_emf(float bus_V, Rotor missed_V) {
    const float turn = v_.finder.omega_e_rad_s * config_.period_s;
    const float emf_V = v_.finder.omega_e_rad_s * config_.finder.flux_linkage_Wb * (1.0f - turn * turn * (1.0f / 24));
    const Rotation ahead = rotation(v_.finder.angle + Angle::from_rad(1.5f * turn));
    v_.pending = modulate(config_.modulator, inverse_park({-missed_V.d, emf_V - missed_V.q}, ahead), {}, bus_V, v_.dead_share);
    return v_.pending.compare;
  }

  // Observer and current control begin with the rotor that was found. What the first voltage was too large by: by its current.
  Rotor adopt_rotor(Stator current_A) {
    const FinderState& f = v_.finder;
    ObserverState& o = v_.observer;
    const ObserverConfig& c = config_.observer;
    const Rotation at = rotation(f.angle);
    const Rotor missed_V = config_.finder.miss_V_A * park(current_A, at);
    o = {};
    o.length_Wb =
        clamp(c.flux_linkage_Wb - missed_V.q / f.omega_e_rad_s, c.length_least * c.flux_linkage_Wb, c.length_most * c.flux_linkage_Wb);
    o.magnet_flux_Wb = {o.length_Wb * at.cos, o.length_Wb * at.sin};
    o.stator_flux_Wb = o.magnet_flux_Wb + c.inductance_H * current_A;
    o.last_current_A = current_A;
    o.flux_ratio = o.length_Wb * c.over_flux;
    o.angle = f.angle;
    o.omega_e_rad_s = o.speed_e_rad_s = f.omega_e_rad_s;
    o.lock = 1.0f;
    ++v_.counters.catches;
    v_.start.pulsed = false;
    take_over(0.0f);
    v_.current.integral_V = -1.0f * missed_V;
    return missed_V;
  }

  // Slot 3: at the voltage limit a negative d current takes voltage off the magnet's share.
  void weaken() {
    const float room_V = config_.weaken_margin * voltage_limit_V(config_.modulator, v_.bus_V) - length(v_.given_V);
    v_.weaken_A = observing() ? clamp(v_.weaken_A + config_.weaken_A_per_V * room_V, -config_.weaken_most_A, 0.0f) : 0.0f;
    v_.bus_A =
        driving() ? 1.5f * (v_.given_V.d * v_.measured_A.d + v_.given_V.q * v_.measured_A.q) / (v_.bus_V > 1.0f ? v_.bus_V : 1.0f) : 0.0f;
    count_energy(config_.health, v_.health, v_.bus_V, v_.bus_A);
    average_duty(config_.health, v_.health, driving() ? kRoot3 * v_.given_V.q : 0.0f, v_.bus_V);
  }

  // Slot 3: what changes with the motor's heat, and the load.
  void follow() {
    if (v_.state == MotorState::running) {
      v_.resistance_ohm =
          step(config_.resistance, v_.learning, v_.resistance_ohm, v_.observer.flux_ratio, v_.measured_A.q, v_.observer.omega_e_rad_s);
    }
    const float w = speed_rad_s();
    v_.health.load_N_m =
        observing() ? config_.health.load_N_m_s2 * w * magnitude(w) - config_.health.inertia_e * v_.observer.unknown_rad_s2 : 0.0f;
  }

  // Slot 4. A lost thermistor costs half the current.
  void limit() {
    const LimitConfig& c = config_.limits;
    const float unknown_K = c.temperature_K - 10.0f;
    const float temperature_K = v_.protection.thermistor_lost && v_.temperature_K < unknown_K ? unknown_K : v_.temperature_K;
    const std::uint16_t faults = v_.protection.restarts;
    const float by_fault = faults == 0 ? c.share : faults == 1 ? c.share_after_one : c.share_after_more;
    // A young estimate is lost in the swing to a full current.
    const float by_age = v_.state == MotorState::handover ? config_.hand_over_share
                         : v_.resistance_measured         ? 1.0f
                                                          : config_.unmeasured_share;
    const float share = by_fault < by_age ? by_fault : by_age;
    v_.range = current_range(c, {speed_rad_s(), v_.bus_V, temperature_K, v_.wanted_A.d, share});
    estimate_winding(config_.health, v_.health, v_.resistance_ohm);
  }

  // The voltage is what holds the motor back: the current loop cannot deliver, or all the field weakening there is is in use.
  bool at_voltage_limit(bool current_loop_limited) const {
    return current_loop_limited || (v_.weaken_A <= -config_.weaken_most_A && config_.weaken_most_A > 0.0f);
  }

  // Slot 5: set-point to torque current.
  void control() {
    const bool voltage_limited = v_.limited_samples >= kSlots / 2;
    v_.limited_samples = 0;
    if (!observing()) return;
    const float w = speed_rad_s(), before_A = v_.wanted_A.q;
    const bool reversing = v_.direction * v_.order.value < 0.0f;
    if (v_.state == MotorState::stopping) {
      give_current(-v_.direction * config_.stop.current_A, w, voltage_limited);
    } else if (v_.order.mode == Mode::speed || reversing) {
      const float target = reversing ? v_.direction * config_.speed.min_speed_rad_s : v_.order.value;
      const SpeedLoopStep s = step(config_.speed, v_.speed, target, w, v_.range, voltage_limited);
      v_.wanted_A.q = s.current_A;
      v_.limiter = at_voltage_limit(voltage_limited) ? Limiter::voltage : s.limiter;
    } else if (v_.order.mode == Mode::duty) {
      // The current that this voltage would drive through R against the back-EMF.
      const float emf_V = v_.observer.omega_e_rad_s * config_.current.flux_linkage_Wb;
      const float asked_V = clamp(v_.order.value, -1.0f, 1.0f) * voltage_limit_V(config_.modulator, v_.bus_V);
      give_current((asked_V - emf_V) * config_.over_resistance, w, voltage_limited);
    } else {
      give_current(v_.order.value, w, voltage_limited);
    }
    v_.wanted_A.q = clamp(v_.wanted_A.q, before_A - config_.most_step_A, before_A + config_.most_step_A);
    const float along_A = v_.state == MotorState::stopping ? 0.0f : hold_current_A(config_.hold, w);
    v_.hold_A = clamp(along_A, v_.hold_A - config_.hold.most_step_A, v_.hold_A + config_.hold.most_step_A);
    v_.wanted_A.d = v_.hold_A + v_.weaken_A;
  }

  // A current as asked, within the limits; above the permitted speed torque fades out over 2 % of it.
  [[gnu::noinline]] void give_current(float wanted_A, float w, bool voltage_limited) {
    const float direction = sign_of(w), most = config_.speed.max_speed_rad_s;
    const float fade = clamp((1.02f * most - magnitude(w)) * config_.speed.over_fade_s, 0.0f, 1.0f);
    const bool driving_on = wanted_A * direction > 0.0f;
    if (driving_on) wanted_A *= fade;
    const Limited limited = limit_current(v_.range, wanted_A, direction);
    v_.wanted_A.q = limited.current_A;
    v_.limiter = at_voltage_limit(voltage_limited) ? Limiter::voltage
                 : limited.by != Limiter::none     ? limited.by
                 : driving_on && fade < 1.0f       ? Limiter::max_speed
                                                   : Limiter::none;
    enter(config_.speed, v_.speed, w, limited.current_A);
  }

  void publish() {
    Telemetry t;
    t.state = v_.state;
    t.fault = v_.protection.fault;
    t.limiter = v_.limiter;
    t.speed_valid = observing() && v_.observer.lock > config_.start.lock;
    t.speed_rad_s = observing() ? speed_rad_s() : v_.own_frame ? v_.start.speed_rad_s : 0.0f;
    t.current_q_A = v_.measured_A.q;
    t.bus_V = v_.bus_V;
    t.bus_A = v_.bus_A;
    t.temperature_K = v_.temperature_K;
    t.error_count = v_.counters.errors();
    t.blocked = v_.blocked;
    t.latched = v_.protection.latched;
    t.temperature_valid = !v_.protection.thermistor_lost;
    t.trips = v_.protection.trips;
    t.bus_mean_A = v_.health.bus_mean_A;
    t.energy_J = v_.health.energy_J + v_.health.energy_rest_J;
    t.winding_K = v_.health.winding_K;
    t.winding_error_K = v_.health.winding_error_K;
    t.load_N_m = v_.health.load_N_m;
    t.duty_q = v_.health.duty_q;
    telemetry_.write(t);
  }

  MotorConfig config_;
  MotorVariables v_{};
  Mailbox<Setpoint> orders_{};
  Mailbox<Telemetry> telemetry_{};
  TripLog trips_{};
  std::uint32_t refused_ = 0;
  SelfTestConfig self_test_config_;
  SelfTestVariables self_test_{};
};

}  // namespace rotorloop::firmware
