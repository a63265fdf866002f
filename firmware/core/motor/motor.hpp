// The motor control of one ESC: on_sample() is the sample interrupt. Every call does the same work whatever the state (the
// observer always runs, the current loop always computes); jobs of the RPM loop and of supervision take turns in six slots, so that
// the cost of an interrupt does not depend on what the motor is doing.
//
// Angle convention as in vector.hpp. All state is in plain structs; the hardware is reached through the Board concept only. The main
// loop calls set_setpoint(), telemetry(), trips() and reads the configuration; on_sample() may interrupt any of them anywhere.
#pragma once
#include "firmware/board/board.hpp"
#include "firmware/core/motor/motor_base.hpp"

namespace rotorloop::firmware {

template <Board B>
class Motor : public MotorBase {
 public:
  explicit Motor(const Parameters& parameters) : Motor(parameters, configure<B>(parameters)) {}

  // The sample interrupt.
  void on_sample(B& board) {
    if (v_.blocked == Blocked::self_test) [[unlikely]]
      test_bridge(board);
    else if (v_.start.pulsed) [[unlikely]]
      find_rotor(board);
    else
      control_motor(board);
  }

 private:
  [[gnu::noinline]] void control_motor(B& board) {
    const AdcCounts adc = board.adc();
    v_.ended = v_.active;
    v_.active = v_.pending;
    const bool was_driven = v_.active_driven;  // during the period that just ended
    v_.active_driven = v_.pending_driven;
    const float bus_V = accept(v_.bus, static_cast<float>(adc.bus) * B::kBus_V_per_count, config_.bus_jump_V);
    v_.counters.bus_doubted += v_.bus.doubted ? 1u : 0u;
    v_.bus_V += config_.bus_filter * (bus_V - v_.bus_V);
    const Sensed sensed = sense(board, adc, bus_V, was_driven);

    // Observer: the voltage of the period that just ended. With the bridge off nothing is known of it: the estimate is kept
    // turning by the phase-locked loop's speed until the next catch.
    const Stator applied_V = was_driven ? bus_V * v_.ended.duty - v_.ended.lost_V : Stator{};
    step(config_.observer, v_.observer, applied_V, sensed.current_A, v_.resistance_ohm, torque_rad_s2(), observing());

    // Frame of the current control.
    v_.own_angle = v_.own_angle + Angle::from_rad(v_.own_omega_e_rad_s * config_.period_s);
    const Rotation at = rotation(v_.own_frame ? v_.own_angle : v_.observer.angle);
    const FrameMotion frame = frame_motion(v_.own_frame ? v_.own_omega_e_rad_s : v_.observer.omega_e_rad_s, config_.period_s);
    v_.turn = frame.full;
    v_.measured_A = park(sensed.current_A, at);
    control_current(frame, bus_V);

    // The command acts from the next sample on, for one period: its middle lies 1.5 periods ahead.
    const Rotation ahead = config_.compensate_delay ? at * (frame.full * frame.half) : at;
    v_.pending = modulate(config_.modulator, inverse_park(v_.given_V, ahead), inverse_park(v_.measured_A, ahead), bus_V, v_.dead_share);
    if (shorted()) v_.pending = {};  // low sides on for good: nothing switches, nothing is lost to dead times
    v_.pending_driven = driving();
    board.set_compare(v_.pending.compare);
    slot_work(board, adc, sensed);
  }

  Motor(const Parameters& parameters, const MotorConfig& config)
      : MotorBase(config,
                  configure_self_test<B>(parameters, config.modulator, config.problem == ParameterProblem::none, config.speed.period_s)) {}

  // --- after power-up, until done ---

  // Takes the place of all else; cold: for size. A sample that was missed, or a supply out of range, ends the attempt.
  [[gnu::cold, gnu::noinline]] void test_bridge(B& board) {
    SelfTestVariables& test = self_test_;
    const SelfTestConfig& c = self_test_config_;
    const AdcCounts adc = board.adc();
    const std::uint64_t now_us = board.time_us();
    v_.slot = v_.slot + 1 == kSlots ? 0 : v_.slot + 1;  // rounds keep their beat
    const float bus_V = accept(v_.bus, static_cast<float>(adc.bus) * B::kBus_V_per_count, config_.bus_jump_V);
    v_.bus_V += config_.bus_filter * (bus_V - v_.bus_V);
    const bool missed = now_us - test.last_us > c.late_us;
    test.last_us = now_us;
    if (!test.under_way || missed) {
      self_test::begin(c, test, v_.bus_V);
      publish();
    }
    Phases i_A;
    for (std::size_t k = 0; k < 3; ++k) i_A[k] = (static_cast<float>(adc.phase[k]) - v_.sense.zero_counts[k]) * config_.sense.A_per_count;
    const SelfTestStep s = step(c, test, i_A);
    const bool supplied = v_.bus_V > config_.protection.undervoltage_V && bus_V < config_.protection.overvoltage_V;
    board.set_compare(s.compare);
    if (!s.done && supplied) return board.gates_on(s.gates);
    board.bridge_off();
    test.under_way = false;
    if (test.result == SelfTest::turning) test.wait = c.wait_ticks;
    if (test.result == SelfTest::failed) report_broken(board);
    disturb_zero(config_.sense, v_.sense);
    v_.round_us = 0;
    v_.blocked = why_not();
    // A supply out of range: the next round of slots says so, and comes back here when it is in range again.
    if (v_.blocked == Blocked::self_test) v_.blocked = Blocked::pause;
    publish();
  }

  void report_broken(B& board) {
    v_.protection.fault = Fault::self_test;
    v_.protection.latched = true;
    ++v_.counters.self_test_failures;
    ++v_.counters.latched_faults;
    ++v_.protection.trips;
    trips_.add({0, static_cast<std::uint32_t>(board.time_us() >> 10), Fault::self_test, MotorState::off, true, v_.bus_V, 0.0f, 0.0f,
                v_.temperature_K});
  }

  // --- a rotor that may be turning, before anything is asked of the bridge ---

  // Takes the place of all else for some milliseconds, but hears its orders.
  [[gnu::noinline]] void find_rotor(B& board) {
    FinderState& f = v_.finder;
    const AdcCounts adc = board.adc();
    v_.round_us = 0;
    v_.slot = v_.slot + 1 == kSlots ? 0 : v_.slot + 1;
    if (v_.slot == 0) {
      take_order();
      if (!wants_motion()) return come_to_rest(board);
    }
    const float bus_V = accept(v_.bus, static_cast<float>(adc.bus) * B::kBus_V_per_count, config_.bus_jump_V);
    if (f.closing > 0) return close_bridge(board, adc, bus_V);
    v_.bus_V += config_.bus_filter * (bus_V - v_.bus_V);
    const Sensed sensed = sense_currents(config_.sense, v_.sense, adc, {});
    disturb_zero(config_.sense, v_.sense);
    const Fault fast = check_fast(config_.protection, sensed, bus_V);
    if (fast != Fault::none) return trip(board, fast, sensed);
    const Finding finding = step(config_.finder, f, sensed.current_A, v_.start.direction);
    if (finding == Finding::looking) {
      board.set_compare(pulse(config_.finder, f.low[2]));
      return board.gates_on(low_gate(0) | low_gate(1) | low_gate(2));
    }
    if (finding == Finding::slow) return short_windings(board);
    board.bridge_off();  // until a voltage stands against the EMF
    f.closing = 2;
    board.set_compare(oppose_emf(bus_V, {}));
  }

  // The first voltage acts from this sample on; at the next its current says by how much it missed the EMF.
  void close_bridge(B& board, const AdcCounts& adc, float bus_V) {
    v_.finder.angle = v_.finder.angle + Angle::from_rad(v_.finder.omega_e_rad_s * config_.period_s);
    v_.active = v_.pending;
    Rotor missed_V{};
    if (v_.finder.closing-- == 2)
      board.bridge_on();
    else
      missed_V = adopt_rotor(sense_currents(config_.sense, v_.sense, adc, v_.active.compare).current_A);
    board.set_compare(oppose_emf(bus_V, missed_V));
    v_.active_driven = v_.pending_driven = true;
  }

  [[gnu::noinline]] void short_windings(B& board) {
    v_.start.pulsed = false;
    v_.start.shorted = true;
    v_.pending = {};
    v_.pending_driven = v_.active_driven = false;
    board.set_compare({});
    board.bridge_on();
  }

  // --- every sample ---

  // Counts to currents that can be trusted; opens the bridge on those that cannot be, and on those that are too large.
  Sensed sense(B& board, const AdcCounts& adc, float bus_V, bool was_driven) {
    Sensed sensed = sense_currents(config_.sense, v_.sense, adc, v_.ended.compare);
    if (driving()) {
      disturb_zero(config_.sense, v_.sense);
      const Stator expected_A = turned(v_.turn, v_.current_A);
      const Sample sample = was_driven ? check_sample(config_.check, v_.check, sensed, expected_A, bus_V) : Sample::good;
      v_.counters.samples_replaced += sample == Sample::replaced ? 1u : 0u;
      const Fault fast = sample == Sample::lost ? Fault::sensor : check_fast(config_.protection, sensed, bus_V);
      if (fast != Fault::none) trip(board, fast, sensed);
    } else {
      calibrate_zero(config_.sense, v_.sense, adc);
    }
    if (was_driven && v_.slot < 3) {  // each phase once in a round
      const std::size_t k = v_.slot;
      follow_zero(config_.sense, v_.sense.zero_counts[k], board.unloaded_counts(k), v_.ended.compare.phase[k]);
    }
    v_.current_A = sensed.current_A;
    v_.residual_A += config_.observer.lock_rate * ((v_.sense.calibrated ? magnitude(sensed.residual_A) : 0.0f) - v_.residual_A);
    return sensed;
  }

  // --- once per round of slots ---

  void slot_work(B& board, const AdcCounts& adc, const Sensed& sensed) {
    switch (v_.slot) {
      case 0:
        supervise(board);
        break;
      case 1:
        start(board);
        break;
      case 2:
        protect(board, adc, sensed);
        break;
      case 3:
        weaken();
        follow();
        break;
      case 4:
        limit();
        break;
      default:
        control();
        publish();
        break;
    }
    v_.slot = v_.slot + 1 == kSlots ? 0 : v_.slot + 1;
  }

  // Slot 0: on, off, retry, reverse, stop.
  void supervise(B& board) {
    ProtectionState& p = v_.protection;
    watch_time(board.time_us());
    take_order();
    if (p.pause_ticks > 0) --p.pause_ticks;
    if (p.restarts > 0 && p.trying_ticks < config_.protection.trying_ticks) ++p.trying_ticks;
    v_.blocked = driving() ? Blocked::none : why_not();
    if (v_.state == MotorState::tone || v_.order.mode == Mode::tone) return sound(board);
    if (!wants_motion()) return come_to_rest(board);
    if (v_.state == MotorState::running || v_.state == MotorState::handover) {
      forgive();
      if (v_.direction * v_.order.value < 0.0f && magnitude(speed_rad_s()) < 1.2f * config_.speed.min_speed_rad_s) {
        enter_phase(MotorState::braking);
        ++v_.counters.reversals;
      }
    } else if (v_.state == MotorState::stopping) {
      v_.state = MotorState::running;  // asked to move again before it stood
      enter(config_.speed, v_.speed, speed_rad_s(), v_.wanted_A.q);
    } else if (const bool shorted = v_.state == MotorState::braking || v_.state == MotorState::holding;
               shorted || (!driving() && v_.blocked == Blocked::none)) {
      if (v_.state == MotorState::fault) ++v_.counters.restarts;
      begin_start(board, shorted);
    }
  }

  // The set-point asks for no motion.
  [[gnu::noinline]] void come_to_rest(B& board) {
    if (v_.state == MotorState::off || v_.sense.zero_out_of_tolerance) return;
    const bool stops = config_.stop.mode != StopMode::coast && fresh();
    if (v_.state == MotorState::running && stops) {
      enter_phase(MotorState::stopping);
      v_.wanted_A.d = v_.weaken_A;
      return;
    }
    if (v_.state == MotorState::stopping && stops) {
      if (magnitude(speed_rad_s()) < 0.8f * config_.speed.min_speed_rad_s) enter_phase(MotorState::holding);
      return;
    }
    if (v_.state == MotorState::holding && stops) {
      v_.phase_s += config_.start.tick_s;
      if (config_.stop.mode == StopMode::drag || v_.phase_s < 2.0f * config_.start.short_brake_s) return;
    }
    ProtectionState& p = v_.protection;
    switch_off(board, MotorState::off);
    p.latched = false;
    p.restarts = p.trying_ticks = 0;
    p.fault = Fault::none;
  }

  // A rotor at rest is pulled to and fro along one axis: half a period each way at the frequency asked for.
  [[gnu::noinline]] void sound(B& board) {
    const bool wanted = v_.order.mode == Mode::tone && v_.order.value >= 50.0f && v_.order.value <= 5000.0f;
    if (v_.state == MotorState::tone) {
      if (!wanted) return switch_off(board, MotorState::off);
      v_.phase_s += config_.start.tick_s * v_.order.value;  // in periods
      if (v_.phase_s >= 1.0f) v_.phase_s -= 1.0f;
      v_.wanted_A = {v_.phase_s < 0.5f ? config_.stop.tone_A : -config_.stop.tone_A, 0.0f};
    } else if (v_.state == MotorState::off) {
      if (!wanted || v_.blocked != Blocked::none) return;
      v_.own_frame = true;
      v_.own_angle = {};
      v_.own_omega_e_rad_s = 0.0f;
      v_.current = {};
      enter_phase(MotorState::tone);
      board.bridge_on();
    } else {
      come_to_rest(board);  // it turns, or has a fault to forgive: first that
    }
  }

  [[gnu::noinline]] void begin_start(B& board, bool shorted) {
    v_.start = {MotorState::catching, 0.0f, 0.0f, sign_of(v_.order.value), 0.0f};
    v_.state = MotorState::catching;
    v_.blocked = Blocked::none;
    self_test_.wait = 0;  // once it has run, it has shown what it can
    hold_to_range(config_.limits, v_.bus_V);
    v_.observer = {};
    v_.current = {};
    v_.wanted_A = {};
    v_.own_frame = false;
    v_.own_omega_e_rad_s = 0.0f;
    v_.weaken_A = v_.hold_A = 0.0f;
    v_.emf_mismatch = 0.0f;
    v_.protection.stall_ticks = v_.protection.slip_ticks = 0;
    v_.check = {};
    v_.dead_share = v_.known_dead_share;
    if (shorted) return short_windings(board);
    v_.start.pulsed = true;
    v_.finder = {};
    v_.finder.low.fill(config_.finder.least_low);
    board.set_compare(pulse(config_.finder, config_.finder.least_low));  // it acts from the next sample on; only then may a gate be driven
  }

  // Slot 1: the start sequence and the hand-over.
  void start(B& board) {
    if (v_.state == MotorState::handover) {
      v_.phase_s += config_.start.tick_s;
      if (v_.phase_s > config_.start.hand_over_s) v_.state = MotorState::running;
    }
    if (!starting()) return;
    const StartStep s = step(config_.start, v_.start,
                             {v_.given_V.d, v_.measured_A.d, lost_along(), v_.across_V, frame_speed_rad_s(), v_.observer.angle,
                              v_.observer.lock, v_.observer.flux_ratio, length(v_.measured_A)});
    if (v_.start.phase == MotorState::align && v_.state != MotorState::align) v_.dead_share = config_.dead_time.align_share;
    v_.state = v_.start.phase;
    if (s.failed) return trip(board, Fault::start_failed, {});
    if (s.caught) {
      ++v_.counters.catches;
      v_.dead_share = v_.known_dead_share;
      v_.current.integral_V = {0.0f, -v_.observer.omega_e_rad_s * config_.current.flux_linkage_Wb};  // from no voltage
      v_.hold_A = v_.measured_A.d;
      return take_over(v_.measured_A.q);
    }
    if (s.hand_over) {
      // The same currents and voltages seen from the observer's frame: no step at the motor.
      const Rotation by = conjugate(rotation(v_.observer.angle - v_.own_angle));
      const Rotor seen_A = by * v_.measured_A;
      const Rotor emf_V{0.0f, v_.observer.omega_e_rad_s * config_.current.flux_linkage_Wb};
      v_.current.integral_V = by * v_.current.integral_V - emf_V;
      v_.hold_A = seen_A.d;
      return take_over(seen_A.q);
    }
    if (s.resistance_ohm > 0.0f) learn_at_rest(s);
    if (s.own_frame && !v_.own_frame) v_.current = {};
    v_.own_frame = s.own_frame;
    if (s.set_frame) v_.own_angle = s.frame;
    v_.own_omega_e_rad_s = v_.start.speed_rad_s * config_.pole_pairs;
    v_.wanted_A = {s.current_A, s.damping_A};
  }

  // Slot 2.
  void protect(B& board, const AdcCounts& adc, const Sensed& sensed) {
    const ProtectionConfig& c = config_.protection;
    const bool lost_before = v_.protection.thermistor_lost;
    watch_thermistor(c, v_.protection, adc.temperature);
    if (v_.protection.thermistor_lost && !lost_before) ++v_.counters.thermistor_lost;
    if (adc.temperature > 8 && adc.temperature < 4087)
      v_.temperature_K =
          accept(v_.temperature, static_cast<float>(adc.temperature) * B::kTemperature_K_per_count + B::kTemperatureZero_K, 5.0f);
    // q voltage without the drops against what the estimated speed should induce: equal when the rotor really turns that fast.
    const float w_e = v_.observer.omega_e_rad_s;
    const float emf_V = v_.given_V.q - v_.resistance_ohm * v_.measured_A.q - w_e * config_.observer.inductance_H * v_.measured_A.d;
    const float excused_V = 0.25f * config_.observer.resistance_ohm * magnitude(v_.measured_A.q) + c.excused_V;
    const float mismatch = mismatch_of(emf_V, w_e * config_.observer.flux_linkage_Wb, excused_V);
    v_.emf_mismatch += c.mismatch_rate * ((v_.state == MotorState::running ? mismatch : 0.0f) - v_.emf_mismatch);
    const Fault fault = check_slow(c, v_.protection,
                                   {v_.bus_V, v_.temperature_K, v_.residual_A, length(v_.measured_A), v_.state == MotorState::running,
                                    speed_rad_s(), v_.direction, v_.observer.lock, v_.emf_mismatch, v_.observer.unknown_rad_s2});
    if (fault != Fault::none && driving()) trip(board, fault, sensed);
  }

  [[gnu::noinline]] void trip(B& board, Fault fault, const Sensed& sensed) {
    ProtectionState& p = v_.protection;
    const MotorState before = v_.state;
    const float speed = observing() ? speed_rad_s() : 0.0f;
    switch_off(board, MotorState::fault);
    p.fault = fault;
    p.pause_ticks = config_.protection.pause_ticks;
    p.healthy_ticks = p.stall_ticks = p.slip_ticks = 0;
    ++p.trips;
    count_trip(v_.counters, fault);
    if (gives_up(config_.protection, p, fault) && !p.latched) {
      p.latched = true;
      ++v_.counters.latched_faults;
    }
    v_.blocked = why_not();
    trips_.add({0, static_cast<std::uint32_t>(board.time_us() >> 10), fault, before, p.latched, v_.bus_V, largest_A(sensed), speed,
                v_.temperature_K});
    publish();
  }

  void switch_off(B& board, MotorState state) {
    board.bridge_off();
    v_.start.shorted = v_.start.pulsed = false;
    v_.state = state;
    v_.pending_driven = v_.active_driven = false;
    v_.own_frame = false;
    v_.own_omega_e_rad_s = 0.0f;
    v_.wanted_A = {};
    v_.weaken_A = 0.0f;
    v_.limiter = Limiter::none;
  }
};

}  // namespace rotorloop::firmware
