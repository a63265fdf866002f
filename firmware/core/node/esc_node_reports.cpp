// What goes out to the bus, and when.
#include "firmware/core/node/esc_node.hpp"

namespace rotorloop::firmware {

void EscNode::poll(std::uint64_t now_us, const Telemetry& t) {
  last_poll_us_ = now_us;
  input_.expire(now_us);
  counters_.tx_expired += static_cast<std::uint32_t>(queue_.expire(now_us));
  if (!started_) {
    started_ = true;
    start_us_ = next_node_status_us_ = next_extended_us_ = next_rpm_us_ = now_us;
    // ESCs switched on together spread their multi-frame telemetry over the period.
    next_status_us_ = now_us + 500'000u * (p_.esc_index % 16u) / 16u;
  } else if (!held_ && mode_ == protocols::NodeMode::initialization) {
    mode_ = protocols::NodeMode::operational;
  }
  serve_one_request(now_us);
  watch_motor(now_us, t);
  watch_commission(now_us);
  if (edited_new_ && !busy(now_us)) {
    edited_new_ = false;
    const std::uint8_t id = p_.node_id;
    p_ = edited_;
    p_.node_id = id;  // a new id from the next start on
    input_.apply(p_);
    index_conflict_ = false;
    ++revision_;
  }
  if ((request_ == NodeRequest::save || request_ == NodeRequest::erase) && now_us - request_us_ > kRequestTimeout_us) complete(false);
  if (index_conflict_ && now_us - index_conflict_us_ > kSilence_us) index_conflict_ = false;
  if (node_id_ == 0) {
    const auto request = now_us >= silent_until_us_ ? allocation_.poll(now_us) : std::nullopt;
    if (request) queue_.push(*request, now_us);
  } else if (speaks(now_us)) {
    watch_enumeration(now_us);
    watch_commanders(now_us);
    report_problem(now_us);
    report_why(now_us);
    send_node_status(now_us);
    send_telemetry(now_us);
  }
  if (feedback_due_) send_feedback(now_us);
}

void EscNode::watch_motor(std::uint64_t now_us, const Telemetry& t) {
  const Fault before = telemetry_.fault;
  const MotorState state = telemetry_.state;
  const SelfTest self_test = telemetry_.self_test.result;
  telemetry_ = t;
  if (p_.dir_reversed) {
    telemetry_.speed_rad_s = -t.speed_rad_s;
    telemetry_.current_q_A = -t.current_q_A;
  }
  input_.set_speed(telemetry_.speed_valid ? telemetry_.speed_rad_s : 0.0f);
  if (t.self_test.result == SelfTest::turning && self_test != SelfTest::turning)
    say(Level::warning, "self-test: not tested, the rotor turns", now_us);
  if (t.fault != Fault::none) {
    tripped_ = true;
    trip_us_ = now_us;
  }
  if (t.fault == Fault::none || t.fault == before) return;
  FaultRecord r{.fault = t.fault, .state = state, .uptime_s = divide(now_us - start_us_, 1'000'000).quotient};
  r.bus_V = t.bus_V;
  r.current_A = t.current_q_A;
  r.temperature_K = t.temperature_K;
  r.rpm = protocols::fast::quantise(telemetry_.speed_rad_s, protocols::fast::kRadPerSecondPerRpm, -131071, 131071);
  r.self_test = t.self_test;
  faults_.add(r);
  say(t.fault == Fault::self_test ? Level::error : Level::warning, describe(r), now_us);
}

// The user presses the button of the ESC whose turn it is, or turns its motor.
void EscNode::watch_enumeration(std::uint64_t now_us) {
  const bool pressed = button_;
  button_ = false;
  if (!enumerating_) return;
  if (now_us > enumeration_end_us_ || led(now_us)) {
    enumerating_ = false;
    return;
  }
  if (!pressed && !hand_) return;
  const protocols::EnumerationIndication indication{.value = {}, .parameter = "esc_index"};
  if (send_message(indication, kIndicationPriority, indication_id_, now_us)) enumerating_ = false;
}

void EscNode::watch_commanders(std::uint64_t now_us) {
  const std::uint8_t second = input_.second_commander(now_us);
  if (second != 0 && reported_second_ == 0) {
    say(Level::warning, TextLine("two commanders: nodes ").add(std::int32_t{second}).add(" and ").add(std::int32_t{input_.commander()}),
        now_us);
  }
  reported_second_ = second;
}

void EscNode::report_problem(std::uint64_t now_us) {
  if (start_report_.text().count != 0) {
    say(Level::warning, start_report_, now_us);
    start_report_ = {};
  }
  if (!problem_reported_ && !parameters_ok()) {
    problem_reported_ = true;
    if (problem_) {
      say(Level::error,
          TextLine("parameter ")
              .add(kParameterRanges[wrong_value_.index].name)
              .add(" is ")
              .add_tenths(wrong_value_.value)
              .add(", allowed ")
              .add_tenths(wrong_value_.min)
              .add(" to ")
              .add_tenths(wrong_value_.max)
              .add(": on defaults, motor off"),
          now_us);
    } else {
      say(Level::error,
          TextLine(store_ == StoreState::empty ? "no parameters stored" : "stored parameters are damaged")
              .add(": on defaults, motor off; set and save them"),
          now_us);
    }
  }
  if ((id_conflict_ || index_conflict_) && !conflict_reported_) {
    conflict_reported_ = true;
    if (id_conflict_) say(Level::error, TextLine("another node has node id ").add(std::int32_t{node_id_}), now_us);
    if (index_conflict_)
      say(Level::error, TextLine("another ESC has esc_index ").add(std::int32_t{p_.esc_index}).add(": fast feedback stopped"), now_us);
  }
}

// Only when somebody wants it to turn and it does not.
void EscNode::report_why(std::uint64_t now_us) {
  const WhyOff why = why_off(now_us);
  const bool wanted =
      why == WhyOff::not_armed || why == WhyOff::zero_first || why == WhyOff::no_index ? input_.wanted(now_us) : why == WhyOff::motor;
  if (!wanted) {
    next_why_us_ = now_us + 200'000;  // a start has this long
    reported_why_ = WhyOff::turning;
    return;
  }
  if (now_us < next_why_us_ || why == reported_why_) return;
  next_why_us_ = now_us + kBlockedReport_us;
  reported_why_ = why;
  TextLine line("not starting: ");
  line.add(why_line(why, telemetry_));
  say(Level::warning, line, now_us);
}

WhyOff EscNode::why_off(std::uint64_t now_us) const {
  if (turning()) return WhyOff::turning;
  if (!parameters_ok()) return WhyOff::parameters;
  if (mode_ != protocols::NodeMode::operational) return WhyOff::starting_up;
  if (commission_.active()) return WhyOff::commissioning;
  if (!may_spin()) return WhyOff::restarting;
  if (p_.esc_index == kNoEscIndex) return WhyOff::no_index;
  switch (input_.order_state(now_us)) {
    case OrderState::not_armed:
      return WhyOff::not_armed;
    case OrderState::none_yet:
      return WhyOff::no_order;
    case OrderState::expired:
      return WhyOff::order_expired;
    case OrderState::zero:
      return WhyOff::order_zero;
    case OrderState::zero_awaited:
      return WhyOff::zero_first;
    default:
      return WhyOff::motor;
  }
}

// ERROR for what does not end by itself: an autopilot takes it for a failed motor. A trip that is over stays a WARNING for a while.
protocols::Health EscNode::health() const {
  using protocols::Health;
  if (!parameters_ok() || id_conflict_ || index_conflict_) return Health::error;
  if (telemetry_.latched || telemetry_.self_test.result == SelfTest::failed || telemetry_.blocked == Blocked::parameters ||
      telemetry_.blocked == Blocked::current_sensor)
    return Health::error;
  const bool tripped = tripped_ && static_cast<float>(last_poll_us_ - trip_us_) <= 1e6f * p_.trip_warn_s;
  const bool hot =
      !telemetry_.temperature_valid || telemetry_.limiter == Limiter::temperature || telemetry_.temperature_K > p_.temperature_warn_K;
  const bool low = p_.voltage_warn_V > 0.0f && telemetry_.bus_V < p_.voltage_warn_V;
  return tripped || hot || low || input_.second_commander(last_poll_us_) != 0 ? Health::warning : Health::ok;
}

protocols::NodeStatus EscNode::node_status(std::uint64_t now_us) const {
  return {.uptime_s = divide(now_us - start_us_, 1'000'000).quotient,
          .health = health(),
          .mode = shown_mode(),
          .vendor_status =
              static_cast<std::uint16_t>(static_cast<unsigned>(telemetry_.fault) | static_cast<unsigned>(telemetry_.limiter) << 8)};
}

void EscNode::answer_node_info(const protocols::Transfer& request, std::uint64_t now_us) {
  using protocols::GetNodeInfoResponse;
  GetNodeInfoResponse r;
  r.status = node_status(now_us);
  r.software_major = identity_.software_major;
  r.software_minor = identity_.software_minor;
  r.software_flags = static_cast<std::uint8_t>((identity_.vcs_commit != 0 ? GetNodeInfoResponse::kHasCommit : 0u) |
                                               (identity_.image_crc != 0 ? GetNodeInfoResponse::kHasImageCrc : 0u));
  r.vcs_commit = identity_.vcs_commit;
  r.image_crc = identity_.image_crc;
  r.hardware_major = identity_.hardware_major;
  r.hardware_minor = identity_.hardware_minor;
  r.unique_id = identity_.unique_id;
  r.certificate.assign(identity_.certificate);
  r.set_name(identity_.name);
  respond(request, r, now_us);
}

void EscNode::answer_opcode(bool ok) {
  respond(opcode_request_, protocols::ParamExecuteOpcodeResponse{.argument = static_cast<std::int64_t>(opcode_argument_), .ok = ok},
          last_poll_us_);
}

void EscNode::send_node_status(std::uint64_t now_us) {
  const bool changed = !sent_node_status_ || health() != sent_health_ || shown_mode() != sent_mode_;
  const bool allowed = !sent_node_status_ || now_us - sent_node_status_us_ >= kNodeStatusMinimum_us;
  if (now_us < next_node_status_us_ && !(changed && allowed)) return;
  if (!send_message(node_status(now_us), kNodeStatusPriority, node_status_id_, now_us)) return;
  sent_node_status_ = true;
  sent_node_status_us_ = now_us;
  sent_health_ = health();
  sent_mode_ = shown_mode();
  next_node_status_us_ = now_us + p_.node_status_ms * std::uint64_t{1000};
  // Said once in full: what is over is over.
  if (id_conflict_ && now_us >= silent_until_us_ + kSilence_us) id_conflict_ = false;
}

// Without an index there is no line of the autopilot's table that this could be.
void EscNode::send_telemetry(std::uint64_t now_us) {
  if (p_.esc_index == kNoEscIndex) return;
  send_status(now_us);
  send_extended(now_us);
  if (p_.rpm_Hz == 0 || !due(next_rpm_us_, 1'000'000u / p_.rpm_Hz, now_us)) return;
  const protocols::RpmSensor s{.sensor_id = p_.esc_index,
                               .flags = telemetry_.speed_valid || !turning() ? std::uint16_t{0} : protocols::RpmSensor::kUnhealthy,
                               .rpm = telemetry_.speed_valid ? telemetry_.speed_rad_s / protocols::fast::kRadPerSecondPerRpm : 0.0f};
  send_message(s, p_.status_priority, rpm_id_, now_us);
}

void EscNode::send_status(std::uint64_t now_us) {
  const bool running = telemetry_.state != MotorState::off;
  const std::uint64_t period_us = 1'000'000u / (running ? p_.status_Hz : p_.status_idle_Hz);
  if (next_status_us_ > now_us + period_us) next_status_us_ = now_us + period_us;  // the motor started: no waiting for the idle period
  if (!due(next_status_us_, period_us, now_us)) return;
  protocols::EscStatus s;
  s.error_count = telemetry_.error_count;
  s.voltage_V = telemetry_.bus_V;
  s.current_A = telemetry_.bus_A;
  s.temperature_K = telemetry_.temperature_K;
  s.rpm =
      telemetry_.speed_valid ? protocols::fast::quantise(telemetry_.speed_rad_s, protocols::fast::kRadPerSecondPerRpm, -131071, 131071) : 0;
  s.power_rating_pct =
      static_cast<std::uint8_t>(protocols::fast::quantise(std::fabs(telemetry_.bus_A), p_.bus_current_limit_A / 100.0f, 0, 127));
  s.esc_index = p_.esc_index;
  send_message(s, p_.status_priority, status_id_, now_us);
}

void EscNode::send_extended(std::uint64_t now_us) {
  if (p_.extended_Hz == 0 || !due(next_extended_us_, 1'000'000u / p_.extended_Hz, now_us)) return;
  const Setpoint order = setpoint(now_us);
  const float full = order.mode == Mode::speed ? p_.max_speed_rad_s : order.mode == Mode::current ? p_.phase_current_limit_A : 1.0f;
  protocols::EscStatusExtended s;
  s.input_pct =
      static_cast<std::uint8_t>(protocols::fast::quantise(order.mode == Mode::off ? 0.0f : std::fabs(order.value), 0.01f * full, 0, 100));
  s.output_pct =
      static_cast<std::uint8_t>(protocols::fast::quantise(std::fabs(telemetry_.speed_rad_s), 0.01f * p_.max_speed_rad_s, 0, 100));
  s.motor_temperature_degC = static_cast<std::int16_t>(protocols::fast::quantise(
      (telemetry_.winding_K > 0.0f ? telemetry_.winding_K : telemetry_.temperature_K) - 273.15f, 1.0f, -256, 255));
  s.status_flags = static_cast<std::uint32_t>(telemetry_.fault) | static_cast<std::uint32_t>(telemetry_.limiter) << 4 |
                   static_cast<std::uint32_t>(why_off(now_us)) << 8 | static_cast<std::uint32_t>(telemetry_.state) << 12 |
                   (armed() ? 1u << 16 : 0u) | (id_conflict_ || index_conflict_ ? 1u << 17 : 0u) | (tripped_ ? 1u << 18 : 0u);
  s.esc_index = p_.esc_index;
  send_message(s, p_.status_priority, extended_id_, now_us);
}

void EscNode::send_feedback(std::uint64_t now_us) {
  feedback_due_ = false;
  protocols::fast::Feedback f;
  f.esc_index = p_.esc_index;
  f.sequence = input_.fast_sequence();
  f.set_speed_rad_s(telemetry_.speed_valid ? telemetry_.speed_rad_s : std::numeric_limits<float>::quiet_NaN());
  f.set_current_A(telemetry_.current_q_A);
  if (identity_.feedback_with_voltage || p_.feedback_voltage) f.set_bus_V(telemetry_.bus_V);
  const CanFrame frame = encode(f);
  if (queue_.replace(frame, now_us)) {
    ++counters_.feedback_superseded;
  } else if (!queue_.push(frame, now_us)) {
    ++counters_.tx_overflow;
  }
}

// A few at once, then one every 200 ms: a fault that flickers must not fill the bus with text.
void EscNode::say(Level level, const TextLine& text, std::uint64_t now_us) {
  constexpr std::uint64_t kEach_us = 200'000, kBurst_us = 1'000'000;
  if (static_cast<std::uint8_t>(level) < p_.log_level || !speaks(now_us)) return;
  const std::uint64_t from_us = log_allowance_us_ + kBurst_us > now_us ? log_allowance_us_ : now_us > kBurst_us ? now_us - kBurst_us : 0;
  if (from_us + kEach_us > now_us) {
    ++counters_.logs_dropped;
    return;
  }
  const protocols::LogMessage m{.level = level, .source = "esc", .text = text.text()};
  if (send_message(m, kLogPriority, log_id_, now_us)) log_allowance_us_ = from_us + kEach_us;
}

}  // namespace rotorloop::firmware
