// The procedure of a commissioning without its board: phases at rest here, those that spin in procedure_spin.cpp.
#pragma once
#include "firmware/core/commission/variables.hpp"

namespace rotorloop::firmware {

class CommissioningProcedure {
 public:
  // From the main loop, again and again.
  void set_order(const CommissioningOrder& order) { orders_.write(order); }
  // Whole, whenever it is asked for.
  CommissioningResult result() const { return results_.read(); }
  // Something is asked for, or not yet over: the interrupt is the commissioning's.
  bool active() const { return running() || wanted(); }
  const CommissioningVariables& variables() const { return v_; }
  const MotorConfig& config() const { return config_; }

 protected:
  struct BoardNumbers {
    float diode_drop_V, switch_ohm, pwm_Hz, A_per_count;
  };

  bool running() const { return v_.phase != CommissioningPhase::idle && v_.phase != CommissioningPhase::finished; }
  // An order to begin, or an order `off` that arms it again.
  bool wanted() const { return orders_.sequence() != 0 && v_.armed == (orders_.read().task != CommissioningTask::off); }
  bool drives() const { return running() && v_.phase != CommissioningPhase::zero && v_.phase != CommissioningPhase::solve; }

  void take_order() {
    const std::uint32_t sequence = orders_.sequence();
    v_.order_age = sequence != v_.order_sequence ? 0 : v_.order_age < config_.order_ticks ? v_.order_age + 1 : v_.order_age;
    v_.order_sequence = sequence;
    if (sequence != 0) v_.order = orders_.read();
  }

  CommissioningEnd follow_order() {
    const bool fresh = v_.order_sequence != 0 && v_.order_age < config_.order_ticks;
    const bool off = v_.order.task == CommissioningTask::off;
    if (running()) return !fresh ? CommissioningEnd::order_expired : off ? CommissioningEnd::cancelled : CommissioningEnd::none;
    if (fresh && off) v_.armed = true;
    if (fresh && !off && v_.armed) begin();
    return CommissioningEnd::none;
  }

  // Once per round of slots while running.
  CommissioningEnd watch() {
    if (v_.sense.zero_out_of_tolerance) return CommissioningEnd::current_sensor;
    const Fault slow = check_slow(config_.protection, v_.protection, {v_.bus_V, v_.temperature_K, 0.0f, length(v_.current_A)});
    return slow == Fault::undervoltage      ? CommissioningEnd::undervoltage
           : slow == Fault::overtemperature ? CommissioningEnd::overtemperature
                                            : CommissioningEnd::none;
  }

  void begin() {
    const CommissioningVariables before = v_;
    v_ = {};
    v_.order = before.order;
    v_.order_sequence = before.order_sequence;
    v_.order_age = before.order_age;
    v_.bus = before.bus;
    v_.bus_V = before.bus_V;
    v_.temperature = before.temperature;
    v_.temperature_K = before.temperature_K;
    v_.armed = false;
    found_ = entered_;
    v_.wants_configuration = true;
    const std::uint32_t number = result_.number + 1u;
    result_ = {};
    result_.number = number;
    result_.temperature_K = v_.temperature_K;
    v_.flux_Wb = entered_.flux_linkage_Wb;
    go_over_zero(CommissioningPhase::guess);
    if (config_.problem != ParameterProblem::none) finish(CommissioningEnd::parameters);
  }

  void finish(CommissioningEnd end) {
    result_.end = end;
    v_.phase = CommissioningPhase::finished;
    publish();
  }

  void publish() {
    result_.phase = v_.phase;
    result_.progress = progress();
    results_.write(result_);
  }

  float progress() const {
    if (v_.phase == CommissioningPhase::finished) return 1.0f;
    const float whole = static_cast<float>(kPasses * kDirections), done = static_cast<float>(v_.pass * kDirections + v_.direction);
    const float rest = v_.order.task == CommissioningTask::all ? 0.7f : 1.0f;
    return result_.standstill_valid ? 0.7f + 0.15f * static_cast<float>(v_.run) : rest * done / whole;
  }

  void go(CommissioningPhase phase) {
    v_.phase = phase;
    v_.samples = 0;
  }
  void go_over_zero(CommissioningPhase next) {
    v_.after_zero = next;
    v_.current = {};
    go(CommissioningPhase::zero);
  }
  float seconds() const { return static_cast<float>(v_.samples) * config_.period_s; }

  // --- every sample ---

  void advance() {
    using enum CommissioningPhase;
    ++v_.samples;
    v_.heat_A2_s += config_.period_s * (v_.current_A.a * v_.current_A.a + v_.current_A.b * v_.current_A.b);
    switch (v_.phase) {
      case zero:
        return wait_for_zero();
      case guess:
        return guess_inductance();
      case align:
        return glide_to(CommissioningPhase::resistance);
      case resistance:
        return measure_level();
      case inductance_d:
        return inject_along(v_.fit_d, {1.0f, 0.0f}, inductance_q);
      case inductance_q:
        return inject_along(v_.fit_q, {0.0f, 1.0f}, solve);
      case solve:
        return next_direction();
      case spin_align:
        return glide_to(CommissioningPhase::ramp);
      case ramp:
      case speed_held:
        return turn_open_loop();
      case accelerate:
      case coast:
        return turn_observed();
      case idle:
      case finished:
        return;
    }
  }

  // --- at rest ---

  void wait_for_zero() {
    const std::uint32_t block = config_.sense.rest_samples + SenseState::kCalibrationSamples + 8u;
    if (v_.samples < 2u * block) return;
    if (!v_.sense.calibrated) return finish(CommissioningEnd::current_sensor);
    result_.zero_counts = v_.sense.zero_counts;
    if (v_.after_zero == CommissioningPhase::guess) {
      set_injection(12.0f);
      v_.angle = {};
    } else {
      begin_glide();
    }
    go(v_.after_zero);
  }

  // The band of the injection: enough current to be beyond the ripple, little against what saturates the iron (a fifth of flux / L).
  void set_injection(float rows) {
    const float knee_A = found_.flux_linkage_Wb / found_.inductance_H, limit_A = found_.phase_current_limit_A;
    const float resistance = found_.resistance_ohm + board_.switch_ohm;
    InjectionConfig& c = v_.inject;
    c.most_V = 0.45f * v_.bus_V;  // more, and two phases leave no sample
    float high_A = 0.25f * knee_A < 0.3f * limit_A ? 0.25f * knee_A : 0.3f * limit_A;
    if (high_A * resistance > 0.45f * c.most_V) high_A = 0.45f * c.most_V / resistance;
    c.high_A = high_A;
    c.low_A = 0.4f * high_A;
    c.resistance_ohm = resistance;
    c.emf_V_A = 0.0f;
    c.rows = static_cast<std::uint32_t>(rows);
    const bool noisy = c.noisy = c.high_A - c.low_A < 25.0f * board_.A_per_count;
    c.lost_V = 0.0f;
    c.zone_A = 3.0f * board_.A_per_count;
    if (noisy) {
      const float by_supply_A = 0.55f * c.most_V / resistance, by_knee_A = 0.3f * knee_A;
      c.high_A = by_supply_A < by_knee_A ? by_supply_A : by_knee_A;
      c.low_A = -c.high_A;
    }
    c.least_samples = noisy ? 12 : 5;
    c.slow_samples = noisy ? 18 : 7;
    c.delay_samples = noisy ? 0.0f : 2.0f;
    if (noisy) c.rows *= 6;
    c.most_samples = static_cast<std::uint32_t>(0.3f / config_.period_s);
    // What the torque turns the rotor by within a burst stays below a tenth of a radian.
    const float kick_rad_s2 = 1.5f * config_.pole_pairs * config_.pole_pairs * found_.flux_linkage_Wb * high_A / found_.inertia_kg_m2;
    const float burst_s = 0.32f / std::sqrt(kick_rad_s2);
    c.burst_samples = static_cast<std::uint32_t>(clamp(burst_s / config_.period_s, 12.0f, 96.0f));
    restart_injection();
  }

  // With the voltages that the last one found.
  void restart_injection() {
    const float up_V = v_.injection.up_V, down_V = v_.injection.down_V;
    v_.injection = {};
    v_.injection.up_V = up_V;
    v_.injection.down_V = down_V;
  }

  // A first inductance, along phase U wherever the magnet is: for the gain of the current loop.
  void guess_inductance() {
    inject_axis(v_.fit_guess, {1.0f, 0.0f});
    if (v_.phase != CommissioningPhase::guess || v_.injection.rows < v_.inject.rows) return;
    const float inductance = solved_inductance_H(v_.fit_guess);
    if (!kPlausibleInductance.holds(inductance)) return finish(CommissioningEnd::inductance_range);
    found_.inductance_H = inductance;
    v_.wants_configuration = true;
    const float resistance = found_.resistance_ohm + board_.switch_ohm, limit_A = found_.phase_current_limit_A;
    const float by_supply_A = 0.35f * v_.bus_V / resistance, wanted_A = 0.3f * limit_A;
    v_.largest_A = wanted_A < by_supply_A ? wanted_A : by_supply_A;
    v_.direct.largest_A = v_.largest_A;
    go_over_zero(CommissioningPhase::align);
  }

  float solved_inductance_H(const LeastSquares<4>& fit) const {
    return inductance_H(fit, found_.inductance_H, config_.period_s, 4.0f * board_.A_per_count);
  }

  // Injection along an axis of the frame.
  void inject_axis(LeastSquares<4>& fit, Rotor axis) {
    const Rotation at = rotation(v_.angle);
    const Rotor i = park(v_.current_A, at), told = park(v_.duty_V, at);
    const InjectionStep s = step(v_.inject, v_.injection, fit, axis.d * i.d + axis.q * i.q, axis.d * told.d + axis.q * told.q);
    v_.command_V = inverse_park(s.v_V * axis, at);
    if (s.failed && !s.done) finish(CommissioningEnd::no_current);
  }

  void inject_along(LeastSquares<4>& fit, Rotor axis, CommissioningPhase next) {
    inject_axis(fit, axis);
    if (v_.phase == CommissioningPhase::finished || v_.injection.rows < v_.inject.rows) return;
    restart_injection();
    if (next == CommissioningPhase::inductance_q) v_.inject.lost_V *= 0.5f * kRoot3;
    const float p = config_.pole_pairs, flux = found_.flux_linkage_Wb;
    v_.inject.emf_V_A =
        next == CommissioningPhase::inductance_q ? 1.5f * p * p * flux * flux * config_.period_s / found_.inertia_kg_m2 : 0.0f;
    go(next);
  }

  Angle direction_angle(std::uint32_t direction) const { return {direction * 715827883u}; }  // a sixth of a turn each

  // From where the vector was, or from far enough that no dead point holds the rotor.
  void begin_glide() {
    const bool first = v_.after_zero == CommissioningPhase::spin_align || (v_.direction == 0 && v_.pass == 0);
    v_.glide_rad = first ? 2.6f : kPi / 3.0f;
    const Angle to = v_.after_zero == CommissioningPhase::spin_align ? Angle{} : direction_angle(v_.direction);
    v_.glide_from = to - Angle::from_rad(v_.glide_rad);
    v_.current = {};
    v_.across_V = v_.across_slow_V = 0.0f;
  }

  // A current vector in a frame that turns at omega_e; the swing of the rotor about it is damped by a current across.
  void hold_vector(float current_A, float damping_share) {
    const float T = config_.period_s;
    v_.angle = v_.angle + Angle::from_rad(v_.omega_e_rad_s * T);
    const Rotation at = rotation(v_.angle);
    const FrameMotion frame = frame_motion(v_.omega_e_rad_s, T);
    v_.seen_A = park(v_.current_A, at);
    const float swing_V = v_.across_V - v_.across_slow_V, most_A = damping_share * current_A;
    v_.wanted_A = {current_A, clamp(-config_.start.damping_A_V * swing_V, -most_A, most_A)};
    const CurrentLoopStep loop =
        step(config_.current, v_.current, v_.wanted_A, v_.seen_A, frame, false, voltage_limit_V(config_.modulator, v_.bus_V));
    v_.across_V += config_.across_filter * (loop.v_V.q - v_.seen_A.q * config_.observer.resistance_ohm - v_.across_V);
    v_.across_slow_V += config_.start.damping_corner_rad_s * T * (v_.across_V - v_.across_slow_V);
    v_.command_V = inverse_park(loop.v_V, at * (frame.full * frame.half));
  }

  void glide_to(CommissioningPhase next) {
    const StartConfig& s = config_.start;
    const float rise_s = 0.02f, glide_s = s.align_first_s * (v_.glide_rad > 2.0f ? 2.0f : 1.0f), settle_s = 1.5f * s.align_second_s;
    const float t = seconds(), share = clamp((t - rise_s) / glide_s, 0.0f, 1.0f), hold_A = 0.6f * v_.largest_A;
    v_.omega_e_rad_s = 0.0f;
    v_.angle = v_.glide_from + Angle::from_rad(share * v_.glide_rad);
    hold_vector(hold_A * clamp(t / rise_s, 0.0f, 1.0f), 0.45f);
    if (t < rise_s + glide_s + settle_s) return;
    v_.level = 0;
    v_.sum_V = v_.sum_A = v_.sum_count = 0.0f;
    go(next);
    if (next == CommissioningPhase::ramp) begin_ramp();
  }

  void measure_level() {
    // A swing's period: what a new current moves the rotor by against its friction induces a voltage.
    const float settle_s = 0.35f * config_.start.align_second_s, window_s = 0.2f * config_.start.align_second_s;
    hold_vector(kLevelShare[v_.level] * v_.largest_A, 0.25f);
    const Rotation at = rotation(v_.angle);
    if (seconds() > settle_s) {
      v_.sum_V += park(v_.duty_V, at).d;
      v_.sum_A += 0.5f * (v_.seen_A.d + park(v_.last_A, at).d);
      v_.sum_count += 1.0f;
    }
    if (seconds() < settle_s + window_s) return;
    const float mean_V = v_.sum_V / v_.sum_count, mean_A = v_.sum_A / v_.sum_count;
    add_window(v_.direct, v_.direction, mean_V, mean_A, v_.heat_A2_s);
    if (v_.level == kLargestLevel) {
      v_.largest_V = mean_V;
      v_.largest_mean_A = mean_A;
    }
    // What the winding takes while the injected current moves must be known well; the dead time drops out of this difference too.
    if (v_.level == kLeastLevel) {
      v_.direction_ohm = (v_.largest_V - mean_V) / (v_.largest_mean_A - mean_A);
      v_.direction_lost_V = v_.largest_V - v_.direction_ohm * v_.largest_mean_A;
    }
    v_.sum_V = v_.sum_A = v_.sum_count = 0.0f;
    v_.samples = 0;
    if (++v_.level < kLevels) return;
    set_injection(40.0f);
    const bool known = v_.pass > 0 || v_.rehearsed;
    if (!known) v_.inject.resistance_ohm = v_.direction_ohm;
    // Along the magnet a leg with the whole current and two with half of it, 4/3; across it two legs, 2/sqrt(3).
    v_.inject.lost_V = !v_.inject.noisy ? 0.0f : known ? 4.0f / 3.0f * v_.passes[0].direct.lost_V : v_.direction_lost_V;
    go(CommissioningPhase::inductance_d);
  }

  // With the bridge off.
  void next_direction() {
    if (++v_.direction < kDirections) return go_over_zero(CommissioningPhase::align);
    PassResult& pass = v_.passes[v_.pass];
    expect_little_heat(v_.direct);
    pass = {solve(v_.direct), solved_inductance_H(v_.fit_d), solved_inductance_H(v_.fit_q)};
    // Better numbers for the second pass: what resistance takes from the ways of the injection, and the knee of the iron.
    if (pass.direct.valid && kPlausibleResistance.holds(pass.direct.resistance_ohm - board_.switch_ohm))
      found_.resistance_ohm = pass.direct.resistance_ohm - board_.switch_ohm;
    v_.direct.sums = {};
    v_.fit_d = v_.fit_q = {};
    v_.direction = 0;
    v_.wants_configuration = true;
    // Where the current is hardly more than noise, the inductances ask for a resistance and a dead time from a pass of their own.
    const bool rehearsal = v_.inject.noisy && !v_.rehearsed;
    v_.rehearsed = true;
    if (rehearsal || ++v_.pass < kPasses) return go_over_zero(CommissioningPhase::align);
    conclude_standstill();
  }

  float board_dead_V() const { return config_.modulator.dead_share * (v_.bus_V + 2.0f * board_.diode_drop_V); }

  void conclude_standstill() {
    const PassResult &one = v_.passes[0], &two = v_.passes[1];
    result_.resistance_ohm = one.direct.resistance_ohm;  // the second began warm
    result_.inductance_d_H = 0.5f * (one.inductance_d_H + two.inductance_d_H);
    result_.inductance_q_H = 0.5f * (one.inductance_q_H + two.inductance_q_H);
    const float lost_V = 0.5f * (one.direct.lost_V + two.direct.lost_V);
    result_.dead_time_s = lost_V / (board_.pwm_Hz * (v_.bus_V + 2.0f * board_.diode_drop_V));
    result_.dead_time_knee_A = 0.5f * (one.direct.knee_A + two.direct.knee_A);
    const CommissioningEnd end = judge_standstill(one, two, board_dead_V());
    if (end != CommissioningEnd::none) return finish(end);
    result_.standstill_valid = true;
    if (v_.order.task == CommissioningTask::standstill) return finish(CommissioningEnd::done);
    found_.resistance_ohm = result_.resistance_ohm - board_.switch_ohm;
    found_.inductance_H = 0.5f * (result_.inductance_d_H + result_.inductance_q_H);
    found_.inductance_ratio = result_.inductance_q_H / result_.inductance_d_H;
    v_.wants_configuration = true;
    go_over_zero(CommissioningPhase::spin_align);
  }

  // --- spinning (procedure_spin.cpp) ---

  static constexpr float kTopShare = 0.5f;  // back-EMF over the longest voltage vector at the top
  static constexpr float kBlock_s = 4e-3f, kBlend_s = 0.02f;

  // … and while turned open-loop: where the current is hardly more than noise, its voltage is a large part.
  float turn_share() const { return v_.inject.noisy ? 0.22f : 0.12f; }
  float full_V() const { return v_.bus_V * (1.0f / kRoot3); }
  float pole_pairs() const { return result_.pole_pairs > 0 ? static_cast<float>(result_.pole_pairs) : config_.pole_pairs; }
  Stator lost_V(Stator current_A, Stator v_V) const;
  Rotor back_emf_V(Angle angle, float omega_e_rad_s, Stator applied_V) const;
  void begin_ramp();
  void turn_open_loop();
  void set_flux(float flux_Wb);
  void take_to_observer(float flux_Wb);
  static Angle small_angle(Rotation r);
  void begin_run();
  void turn_observed();
  void record(bool idle, Stator applied_V);
  void end_acceleration();
  void end_coast();
  void conclude_spin();

  Parameters entered_{}, found_{};
  MotorConfig config_{};
  BoardNumbers board_{};
  CommissioningVariables v_{};
  CommissioningResult result_{};
  Mailbox<CommissioningOrder> orders_{};
  Mailbox<CommissioningResult> results_{};
};

}  // namespace rotorloop::firmware
