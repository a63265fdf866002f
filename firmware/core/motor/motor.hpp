// The motor control of one ESC: on_sample() is the 24 kHz interrupt. Every call does the same work whatever the state (the
// observer always runs, the current loop always computes); once-per-millisecond-quarter jobs take turns in six slots, so that
// the cost of an interrupt does not depend on what the motor is doing.
//
// Angle convention as in vector.hpp. All state is in plain structs; the hardware is reached through the Board concept only.
#pragma once
#include <cmath>

#include "firmware/board/board.hpp"
#include "firmware/core/motor/config.hpp"
#include "firmware/core/motor/counters.hpp"

namespace rotorloop::firmware {

struct MotorVariables {
  SenseState sense{};
  ObserverState observer{};
  CurrentLoopState current{};
  SpeedLoopState speed{};
  StartState start{};
  ProtectionState protection{};
  Counters counters{};

  // Command pipeline: computed in one interrupt, active in the next period, measured at its end.
  Modulated pending{}, active{};
  bool pending_driven = false, active_driven = false;

  MotorState state = MotorState::off;
  bool own_frame = false;  // current control in a turned frame instead of the observer's
  Angle own_angle{};
  float own_omega_e_rad_s = 0.0f;
  Rotor wanted_A{};
  Rotor measured_A{};
  Rotor given_V{};
  float along_V = 0.0f, across_V = 0.0f;  // d and q voltage, smoothed
  float resistance_ohm = 0.0f;            // phase and switch, measured at the last start and followed since
  ResistanceState learning{};
  bool voltage_limited = false;
  std::uint32_t limited_samples = 0;  // of the last kSlots
  float bus_V = 0.0f, temperature_K = 0.0f;
  float residual_A = 0.0f;
  float bus_A = 0.0f;
  float emf_mismatch = 0.0f;
  float fade_d_A = 0.0f;
  float weaken_A = 0.0f;   // <= 0
  float direction = 1.0f;  // sense of rotation while running
  float phase_s = 0.0f;    // time in handover or braking
  CurrentRange range{};
  Limiter limiter = Limiter::none;
  std::uint32_t slot = 0;
};

template <Board B>
class Motor {
 public:
  explicit Motor(const Parameters& parameters) : config_(configure<B>(parameters)) { v_.resistance_ohm = config_.observer.resistance_ohm; }

  // Refuses what is not a number: keeps the last one and counts.
  void set_setpoint(const Setpoint& s) {
    if (std::isfinite(s.value))
      setpoint_ = s;
    else
      ++v_.counters.setpoints_refused;
  }

  // The sample interrupt.
  void on_sample(B& board) {
    const AdcCounts adc = board.adc();
    v_.active = v_.pending;
    const bool was_driven = v_.active_driven;  // during the period that just ended
    v_.active_driven = v_.pending_driven;
    const float bus_V = static_cast<float>(adc.bus) * B::kBus_V_per_count;
    v_.bus_V += 0.25f * (bus_V - v_.bus_V);
    v_.temperature_K = static_cast<float>(adc.temperature) * B::kTemperature_K_per_count + B::kTemperatureZero_K;
    calibrate_zero(config_.sense, v_.sense, adc);
    const Sensed sensed = sense_currents(config_.sense, v_.sense, adc, ended_.compare);
    count_windows(sensed, was_driven);

    const Fault fast = check_fast(config_.protection, sensed, bus_V);
    if (fast != Fault::none && v_.sense.calibrated && driving()) trip(board, fast);

    // Observer: the voltage of the period that just ended. With the bridge off nothing is known of it: the estimate is kept
    // turning by the phase-locked loop's speed until the next catch.
    const Stator applied_V = was_driven ? bus_V * ended_.duty - ended_.lost_V : Stator{};
    step(config_.observer, v_.observer, applied_V, sensed.current_A, v_.resistance_ohm, torque_rad_s2(), observing());

    // Frame of the current control.
    v_.own_angle = v_.own_angle + Angle::from_rad(v_.own_omega_e_rad_s * config_.period_s);
    const Rotation at = rotation(v_.own_frame ? v_.own_angle : v_.observer.angle);
    const FrameMotion frame = frame_motion(v_.own_frame ? v_.own_omega_e_rad_s : v_.observer.omega_e_rad_s, config_.period_s);
    v_.measured_A = park(sensed.current_A, at);
    const CurrentLoopStep loop =
        step(config_.current, v_.current, v_.wanted_A, v_.measured_A, frame, !v_.own_frame, voltage_limit_V(config_.modulator, bus_V));
    v_.given_V = v_.state == MotorState::braking ? Rotor{} : loop.v_V;
    v_.along_V += config_.across_filter * (loop.v_V.d - v_.along_V);
    v_.across_V += config_.across_filter * (loop.v_V.q - v_.across_V);
    v_.voltage_limited = loop.limited;
    v_.limited_samples += loop.limited ? 1u : 0u;
    v_.counters.voltage_limited += loop.limited && driving() ? 1u : 0u;
    if (!driving() || v_.state == MotorState::braking) v_.current = {};

    // The command acts from the next sample on, for one period: its middle lies 1.5 periods ahead.
    const Rotation ahead = config_.compensate_delay ? at * (frame.full * frame.half) : at;
    ended_ = v_.active;
    v_.pending = modulate(config_.modulator, inverse_park(v_.given_V, ahead), inverse_park(v_.measured_A, ahead), bus_V);
    v_.pending_driven = driving();
    board.set_compare(v_.pending.compare);
    slot_work(board, sensed);
  }

  Telemetry telemetry() const {
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
    return t;
  }

  bool calibrated() const { return v_.sense.calibrated; }
  const MotorVariables& variables() const { return v_; }
  const Counters& counters() const { return v_.counters; }
  const MotorConfig& config() const { return config_; }
  MotorConfig& config() { return config_; }  // tests that switch one protection off to show what it prevents

 private:
  float speed_rad_s() const { return v_.observer.speed_e_rad_s / config_.pole_pairs; }
  float frame_speed_rad_s() const { return v_.observer.omega_e_rad_s / config_.pole_pairs; }
  bool observing() const { return v_.state == MotorState::running || v_.state == MotorState::handover; }
  bool driving() const { return v_.state != MotorState::off && v_.state != MotorState::fault; }

  // Electrical acceleration from the firmware's model of the torque; only when the frame is the rotor's.
  float torque_rad_s2() const {
    if (!observing()) return 0.0f;
    const SpeedLoopConfig& c = config_.speed;
    const float w = speed_rad_s();
    return config_.pole_pairs * (c.torque_constant_N_m_A * v_.measured_A.q - c.load_N_m_s2 * w * magnitude(w)) / c.inertia_kg_m2;
  }

  void count_windows(const Sensed& sensed, bool was_driven) {
    if (!was_driven) return;
    if (sensed.usable == 2) ++v_.counters.two_phase_samples;
    if (sensed.usable < 2) ++v_.counters.blind_samples;
  }

  void trip(B& board, Fault fault) {
    board.bridge_off();
    v_.state = MotorState::fault;
    v_.pending_driven = v_.active_driven = false;
    v_.own_frame = false;
    v_.wanted_A = {};
    v_.protection.fault = fault;
    v_.protection.pause_ticks = config_.protection.pause_ticks;
    v_.protection.healthy_ticks = 0;
    v_.protection.stall_ticks = 0;
    v_.limiter = Limiter::none;
    switch (fault) {
      case Fault::overcurrent:
        ++v_.counters.overcurrent_trips;
        break;
      case Fault::overvoltage:
        ++v_.counters.overvoltage_trips;
        break;
      case Fault::undervoltage:
        ++v_.counters.undervoltage_trips;
        break;
      case Fault::overtemperature:
        ++v_.counters.overtemperature_trips;
        break;
      case Fault::sensor:
        ++v_.counters.sensor_trips;
        break;
      case Fault::stall:
        ++v_.counters.stalls;
        break;
      case Fault::start_failed:
        ++v_.counters.start_failures;
        break;
      case Fault::none:
        break;
    }
    // Supply and temperature faults wait for their cause to go; the others are retried a limited number of times.
    const bool own = fault == Fault::overcurrent || fault == Fault::stall || fault == Fault::start_failed || fault == Fault::sensor;
    if (own && ++v_.protection.restarts > config_.protection.most_restarts && !v_.protection.latched) {
      v_.protection.latched = true;
      ++v_.counters.latched_faults;
    }
  }

  void switch_off(B& board) {
    board.bridge_off();
    v_.state = MotorState::off;
    v_.pending_driven = v_.active_driven = false;
    v_.own_frame = false;
    v_.wanted_A = {};
    v_.weaken_A = 0.0f;
    v_.limiter = Limiter::none;
  }

  bool wants_motion() const {
    return (setpoint_.mode == Mode::speed && setpoint_.value != 0.0f) ||
           (setpoint_.mode == Mode::duty && magnitude(setpoint_.value) > 0.02f) ||
           (setpoint_.mode == Mode::current && magnitude(setpoint_.value) > 0.1f);
  }

  void slot_work(B& board, const Sensed& sensed) {
    v_.residual_A += 0.02f * ((v_.sense.calibrated ? magnitude(sensed.residual_A) : 0.0f) - v_.residual_A);
    switch (v_.slot) {
      case 0:
        supervise(board);
        break;
      case 1:
        start(board);
        break;
      case 2:
        protect(board);
        break;
      case 3:
        weaken();
        if (v_.state == MotorState::running)
          v_.resistance_ohm =
              step(config_.resistance, v_.learning, v_.resistance_ohm, v_.observer.flux_ratio, v_.measured_A.q, v_.observer.omega_e_rad_s);
        break;
      case 4:
        v_.range = current_range(config_.limits, {speed_rad_s(), v_.bus_V, v_.temperature_K, v_.wanted_A.d});
        break;
      default:
        control();
        break;
    }
    v_.slot = v_.slot + 1 == kSlots ? 0 : v_.slot + 1;
  }

  // Slot 0: on, off, retry, reverse.
  void supervise(B& board) {
    ProtectionState& p = v_.protection;
    if (p.pause_ticks > 0) --p.pause_ticks;
    if (v_.sense.zero_out_of_tolerance && p.fault != Fault::sensor) {
      p.fault = Fault::sensor;
      p.latched = true;
      ++v_.counters.calibration_failures;
      v_.state = MotorState::fault;
    }
    if (!wants_motion()) {
      if (v_.state != MotorState::off && !v_.sense.zero_out_of_tolerance) {
        switch_off(board);
        p.latched = false;
        p.restarts = 0;
        p.fault = Fault::none;
      }
      return;
    }
    if (observing()) {
      if (p.healthy_ticks < config_.protection.healthy_ticks)
        ++p.healthy_ticks;
      else
        p.restarts = 0, p.fault = Fault::none;
      if (v_.direction * setpoint_.value < 0.0f && magnitude(speed_rad_s()) < 1.2f * config_.speed.min_speed_rad_s) {
        v_.state = MotorState::braking;
        v_.phase_s = 0.0f;
        v_.wanted_A = {};
        ++v_.counters.reversals;
      }
    } else if (v_.state == MotorState::braking) {
      v_.phase_s += config_.start.tick_s;
      if (v_.phase_s > config_.start.short_brake_s) begin_start(board);
    } else if (!driving() && v_.sense.calibrated && may_start(config_.protection, p, v_.bus_V, v_.temperature_K)) {
      if (v_.state == MotorState::fault) ++v_.counters.restarts;
      begin_start(board);
    }
  }

  void begin_start(B& board) {
    v_.start = {MotorState::catching, 0.0f, 0.0f, sign_of(setpoint_.value), 0.0f};
    v_.state = MotorState::catching;
    v_.observer = {};
    v_.current = {};
    v_.wanted_A = {};
    v_.own_frame = false;
    v_.own_omega_e_rad_s = 0.0f;
    v_.weaken_A = 0.0f;
    v_.emf_mismatch = 0.0f;
    v_.protection.stall_ticks = 0;
    board.bridge_on();
  }

  // Slot 1: the start sequence and the hand-over.
  void start(B& board) {
    const StartStep s = step(config_.start, v_.start,
                             {v_.along_V, v_.measured_A.d, v_.across_V - v_.resistance_ohm * v_.measured_A.q, frame_speed_rad_s(),
                              v_.observer.lock, v_.observer.flux_ratio});
    if (v_.state == MotorState::catching || v_.state == MotorState::align || v_.state == MotorState::ramp) {
      v_.state = v_.start.phase;
      if (s.failed) return trip(board, Fault::start_failed);
      if (s.caught) {
        ++v_.counters.catches;
        return take_over(0.0f);
      }
      if (s.hand_over) {
        // The same currents and voltages seen from the observer's frame: no step at the motor.
        const Rotation by = conjugate(rotation(v_.observer.angle - v_.own_angle));
        const Rotor seen_A = by * v_.measured_A;
        const Rotor emf_V{0.0f, v_.observer.omega_e_rad_s * config_.current.flux_linkage_Wb};
        v_.current.integral_V = by * v_.current.integral_V - emf_V;
        v_.fade_d_A = seen_A.d;
        return take_over(seen_A.q);
      }
      if (s.resistance_ohm > 0.0f) learn_resistance(s.resistance_ohm);
      if (s.own_frame && !v_.own_frame) v_.current = {};
      v_.own_frame = s.own_frame;
      if (s.set_frame) v_.own_angle = s.frame;
      v_.own_omega_e_rad_s = v_.start.speed_rad_s * config_.pole_pairs;
      v_.wanted_A = {s.current_A, s.damping_A};
    } else if (v_.state == MotorState::handover) {
      v_.phase_s += config_.start.tick_s;
      if (v_.phase_s > config_.start.hand_over_s) {
        v_.state = MotorState::running;
        v_.fade_d_A = 0.0f;
      }
    }
  }

  void learn_resistance(float measured_ohm) {
    if (measured_ohm >= config_.resistance.least_ohm && measured_ohm <= config_.resistance.most_ohm)
      v_.resistance_ohm = measured_ohm;
    else
      ++v_.counters.resistance_refused;
  }

  void take_over(float current_q_A) {
    v_.own_frame = false;
    v_.start.phase = MotorState::off;
    v_.state = MotorState::handover;
    v_.phase_s = 0.0f;
    v_.direction = sign_of(v_.observer.omega_e_rad_s);
    v_.wanted_A = {v_.fade_d_A, current_q_A};
    v_.learning = {v_.observer.flux_ratio, 0.0f};
    enter(config_.speed, v_.speed, speed_rad_s(), current_q_A);
  }

  // Slot 2.
  void protect(B& board) {
    // q voltage without the drops against what the estimated speed should induce: equal when the rotor really turns that fast.
    const float w_e = v_.observer.omega_e_rad_s;
    const float emf_V = v_.given_V.q - v_.resistance_ohm * v_.measured_A.q - w_e * config_.observer.inductance_H * v_.measured_A.d;
    const float expected_V = w_e * config_.observer.flux_linkage_Wb;
    const float excused_V = 0.25f * config_.observer.resistance_ohm * magnitude(v_.measured_A.q) + 0.1f;
    const float excess_V = magnitude(emf_V - expected_V) - excused_V;
    const float mismatch = excess_V > 0.0f ? excess_V / (magnitude(expected_V) + 0.05f) : 0.0f;
    v_.emf_mismatch += 0.1f * ((v_.state == MotorState::running ? (mismatch < 3.0f ? mismatch : 3.0f) : 0.0f) - v_.emf_mismatch);
    const Fault fault = check_slow(config_.protection, v_.protection,
                                   {v_.bus_V, v_.temperature_K, v_.residual_A, length(v_.measured_A), v_.state == MotorState::running,
                                    speed_rad_s(), v_.direction, v_.observer.lock, v_.emf_mismatch});
    if (fault != Fault::none && driving()) trip(board, fault);
  }

  // Slot 3: at the voltage limit a negative d current takes voltage off the magnet's share.
  void weaken() {
    const float room_V = config_.weaken_margin * voltage_limit_V(config_.modulator, v_.bus_V) - length(v_.given_V);
    v_.weaken_A = observing() ? clamp(v_.weaken_A + config_.weaken_A_per_V * room_V, -config_.weaken_most_A, 0.0f) : 0.0f;
    v_.bus_A =
        driving() ? 1.5f * (v_.given_V.d * v_.measured_A.d + v_.given_V.q * v_.measured_A.q) / (v_.bus_V > 1.0f ? v_.bus_V : 1.0f) : 0.0f;
  }

  // The voltage is what holds the motor back: the current loop cannot deliver, or all the field weakening there is is in use.
  bool at_voltage_limit(bool current_loop_limited) const { return current_loop_limited || v_.weaken_A <= -config_.weaken_most_A; }

  // Slot 5: set-point to torque current.
  void control() {
    const bool voltage_limited = v_.limited_samples >= kSlots / 2;
    v_.limited_samples = 0;
    if (!observing()) return;
    const float w = speed_rad_s(), direction = sign_of(w);
    const bool reversing = v_.direction * setpoint_.value < 0.0f;
    if (setpoint_.mode == Mode::speed || reversing) {
      const float target = reversing ? v_.direction * config_.speed.min_speed_rad_s : setpoint_.value;
      const SpeedLoopStep s = step(config_.speed, v_.speed, target, w, v_.range, voltage_limited);
      v_.wanted_A.q = s.current_A;
      v_.limiter = at_voltage_limit(voltage_limited) ? Limiter::voltage : s.limiter;
    } else {
      // Duty: the current that this voltage would drive through R against the back-EMF. Current: as asked.
      float wanted_A = setpoint_.value;
      if (setpoint_.mode == Mode::duty) {
        const float emf_V = v_.observer.omega_e_rad_s * config_.current.flux_linkage_Wb;
        wanted_A =
            (clamp(setpoint_.value, -1.0f, 1.0f) * voltage_limit_V(config_.modulator, v_.bus_V) - emf_V) / config_.observer.resistance_ohm;
      }
      // Above the permitted speed torque fades out over 2 % of it.
      const float fade =
          clamp((1.02f * config_.speed.max_speed_rad_s - magnitude(w)) / (0.02f * config_.speed.max_speed_rad_s), 0.0f, 1.0f);
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
    const float left = v_.state == MotorState::handover ? 1.0f - clamp(v_.phase_s / config_.start.hand_over_s, 0.0f, 1.0f) : 0.0f;
    v_.wanted_A.d = v_.fade_d_A * left + v_.weaken_A;
  }

  MotorConfig config_;
  MotorVariables v_{};
  Setpoint setpoint_{};
  Modulated ended_{};  // what acted in the period before the present sample
};

}  // namespace rotorloop::firmware
