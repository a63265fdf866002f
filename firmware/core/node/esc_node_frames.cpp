// What comes in from the bus.
#include "firmware/core/node/esc_node.hpp"

namespace rotorloop::firmware {

void EscNode::on_frame(const CanFrame& frame, std::uint64_t now_us) {
  ++counters_.frames;
  input_.on_other_traffic(now_us);
  if (!frame.extended) return on_standard_frame(frame, now_us);
  if (node_id_ != 0 && (frame.id & 127u) == node_id_) return on_own_id(now_us);
  commission_.heard(static_cast<std::uint8_t>(frame.id & 127u), now_us);
  if ((frame.id & 0x80u) == 0) {
    if (const auto t = receiver_.accept(frame, now_us)) on_message(*t, now_us);
  } else if (node_id_ != 0 && (frame.id >> 8 & 127u) == node_id_ && !service_frames_.push(frame)) {
    ++counters_.service_overflow;
  }
}

// One request a poll: an answer costs more than anything else that a frame can ask for. Whoever floods the node with requests gets as many
// answers and no more of its time; five at once are answered within five polls.
void EscNode::serve_one_request(std::uint64_t now_us) {
  while (const auto frame = service_frames_.pop()) {
    if (const auto t = services_.accept(*frame, now_us)) return on_request(*t, now_us);
  }
}

// A bus never gives us our own frames: another node has our id. Both would talk at once in the same arbitration, which throws both
// off the bus; so we are silent as long as the other one is heard. A motor that turns goes on turning on fresh orders.
void EscNode::on_own_id(std::uint64_t now_us) {
  ++counters_.id_conflicts;
  id_conflict_ = true;
  conflict_reported_ = false;
  silent_until_us_ = now_us + kSilence_us;
  queue_.clear();
  if (p_.node_id != 0) return;
  // An id that was allocated: ask for another one.
  node_id_ = 0;
  id_conflict_ = false;
  receiver_.set_own_node(0);
  services_.set_own_node(0);
  allocation_ = AllocationClient(identity_.unique_id, p_.preferred_id);
}

void EscNode::on_own_index(std::uint64_t now_us) {
  ++counters_.index_conflicts;
  if (!index_conflict_) conflict_reported_ = false;
  index_conflict_ = true;
  index_conflict_us_ = now_us;
  feedback_due_ = false;
}

void EscNode::on_standard_frame(const CanFrame& frame, std::uint64_t now_us) {
  namespace fast = protocols::fast;
  if (p_.esc_index == kNoEscIndex) return;
  if (fast::is_feedback_id(frame) && (frame.id & 15u) == p_.esc_index) return on_own_index(now_us);
  if (!fast::is_setpoint_id(frame) || (frame.id & 3u) != p_.esc_index / 4u) return;
  if (const auto version = fast::decode_version(frame)) {
    if (*version != fast_version_ && *version != fast::kVersion) {
      say(Level::error,
          TextLine("fast channel: the host has version ")
              .add(std::int32_t{*version})
              .add(", this ESC ")
              .add(std::int32_t{fast::kVersion})
              .add(": set-points refused"),
          now_us);
    }
    fast_version_ = *version;
    fast_version_us_ = now_us;
    return;
  }
  if (!p_.fast_channel) {
    ++counters_.fast_disabled;
    return;
  }
  const auto s = fast::decode_setpoint(frame);
  if (!s) {
    ++counters_.fast_malformed;
    return;
  }
  if (fast_version_ != 0 && fast_version_ != fast::kVersion && now_us - fast_version_us_ <= kVersionCounts_us) {
    ++counters_.fast_version;
    return;
  }
  if (!input_.on_fast(*s, now_us)) return;
  // By sequence number and not by a counter of its own: all ESCs answer the same set-points.
  if (p_.fast_feedback_Hz > 0 && !index_conflict_ && s->sequence % (1000u / p_.fast_feedback_Hz) == 0) feedback_due_ = true;
}

void EscNode::on_message(const protocols::Transfer& t, std::uint64_t now_us) {
  switch (t.id.data_type_id) {
    case protocols::RawCommand::kType.id: {
      protocols::RawCommand c;
      decode(t.payload, c);
      input_.on_raw(c, now_us, t.id.source);
      receiver_.keep(input_.commander());
      break;
    }
    case protocols::RpmCommand::kType.id: {
      protocols::RpmCommand c;
      decode(t.payload, c);
      input_.on_rpm(c, now_us, t.id.source);
      receiver_.keep(input_.commander());
      break;
    }
    case protocols::ArmingStatus::kType.id:
      on_arming(t);
      break;
    case protocols::EscStatus::kType.id: {
      protocols::EscStatus s;
      if (decode(t.payload, s) && p_.esc_index != kNoEscIndex && s.esc_index == p_.esc_index) on_own_index(now_us);
      break;
    }
    case protocols::Allocation::kType.id:
      on_allocation(t, now_us);
      break;
    case protocols::BeepCommand::kType.id:
      on_beep(t, now_us);
      break;
    default:
      break;
  }
}

void EscNode::on_arming(const protocols::Transfer& t) {
  protocols::ArmingStatus a;
  // Arming is taken only in exactly its form; a longer transfer that happens to begin with 255 is not an order to arm.
  if (!decode(t.payload, a) ||
      (a.status == protocols::ArmingStatus::kFullyArmed && t.payload.size() != protocols::ArmingStatus::kMaxBytes)) {
    ++counters_.payload_wrong_size;
  } else {
    input_.on_arming(a.status);
  }
}

// What a motor can sound and an ear can hear; at most 2 s, so that a lost stop is no siren.
void EscNode::on_beep(const protocols::Transfer& t, std::uint64_t now_us) {
  protocols::BeepCommand b;
  if (!decode(t.payload, b) || !(b.frequency_Hz >= 100.0f && b.frequency_Hz <= 10'000.0f) || !(b.duration_s > 0.0f)) {
    ++counters_.undecodable;
    return;
  }
  beep_Hz_ = b.frequency_Hz;
  beep_until_us_ = now_us + static_cast<std::uint32_t>(1e6f * (b.duration_s < 2.0f ? b.duration_s : 2.0f));
}

void EscNode::on_allocation(const protocols::Transfer& t, std::uint64_t now_us) {
  protocols::Allocation a;
  if (node_id_ != 0 || !decode(t.payload, a)) return;
  const auto id = allocation_.on_message(a, now_us);
  if (!id || *id > 125) return;
  node_id_ = *id;
  receiver_.set_own_node(node_id_);
  services_.set_own_node(node_id_);
  next_node_status_us_ = now_us;
}

void EscNode::on_request(const protocols::Transfer& t, std::uint64_t now_us) {
  if (!speaks(now_us)) return;
  if (queue_.room() < kSmallestAnswer + kReservedForTelemetry) {  // nothing that is asked for now would be sent
    ++counters_.tx_overflow;
    return;
  }
  switch (t.id.data_type_id) {
    case protocols::GetNodeInfo::kType.id:
      return answer_node_info(t, now_us);
    case protocols::ParamGetSet::kType.id:
      return on_get_set(t, now_us);
    case protocols::ParamExecuteOpcode::kType.id:
      return on_opcode(t, now_us);
    case protocols::RestartNode::kType.id:
      return on_restart(t, now_us);
    case protocols::EnumerationBegin::kType.id:
      return on_enumeration(t, now_us);
    case protocols::BeginFirmwareUpdate::kType.id:
      return on_update(t, now_us);
    default:
      return;
  }
}

void EscNode::on_get_set(const protocols::Transfer& t, std::uint64_t now_us) {
  protocols::ParamGetSet q;
  if (!decode(t.payload, q)) {
    ++counters_.undecodable;
    return;
  }
  if (const std::int32_t task = ParameterServer::commission_asked(q); task >= 0) order_commission(task, t.id.source, now_us);
  const Readings readings{.why = why_off(now_us),
                          .faults = &faults_,
                          .motor = &telemetry_,
                          .commanders = input_.counters().second_commander,
                          .conflicts = counters_.id_conflicts + counters_.index_conflicts,
                          .started = &at_start_};
  const protocols::ParamGetSetResponse r = ParameterServer::answer(q, edited_, commission_, readings);
  if (q.value.kind != protocols::ParamValue::Kind::empty) edited_new_ = true;
  respond(t, r, now_us);
}

// Answered when the application has done it: the flash may take longer than a request waits, and then says so.
void EscNode::on_opcode(const protocols::Transfer& t, std::uint64_t now_us) {
  protocols::ParamExecuteOpcode q;
  if (!decode(t.payload, q)) {
    ++counters_.undecodable;
    return;
  }
  const bool known = q.opcode == protocols::ParamExecuteOpcode::kSave || q.opcode == protocols::ParamExecuteOpcode::kErase;
  if (busy(now_us)) ++counters_.refused_while_running;
  if (!known || busy(now_us) || request_ != NodeRequest::none) {
    respond(t, protocols::ParamExecuteOpcodeResponse{.argument = q.argument, .ok = false}, now_us);
    return;
  }
  opcode_request_ = t;
  opcode_request_.payload = {};
  opcode_argument_ = static_cast<std::uint64_t>(q.argument);
  request_us_ = now_us;
  request_ = q.opcode == protocols::ParamExecuteOpcode::kSave ? NodeRequest::save : NodeRequest::erase;
}

void EscNode::on_restart(const protocols::Transfer& t, std::uint64_t now_us) {
  protocols::RestartNode q;
  if (!decode(t.payload, q)) {
    ++counters_.undecodable;
    return;
  }
  if (busy(now_us)) ++counters_.refused_while_running;
  const bool ok = q.magic == protocols::RestartNode::kMagic && !busy(now_us) && request_ == NodeRequest::none;
  if (!respond(t, protocols::RestartNodeResponse{.ok = ok}, now_us) || !ok) return;
  request_ = NodeRequest::restart;
  request_us_ = now_us;
}

// The parameter is the one that holds our index, by its name here, or whatever an empty name leaves to us.
void EscNode::on_enumeration(const protocols::Transfer& t, std::uint64_t now_us) {
  using Error = protocols::EnumerationBeginResponse::Error;
  protocols::EnumerationBegin q;
  if (!decode(t.payload, q)) {
    ++counters_.undecodable;
    return;
  }
  Error error = Error::ok;
  if (led(now_us)) {
    ++counters_.refused_while_running;
    error = Error::invalid_mode;
  } else if (q.parameter.count > 0 && !q.parameter.is("esc_index")) {
    error = Error::invalid_parameter;
  }
  if (!respond(t, protocols::EnumerationBeginResponse{.error = error}, now_us) || error != Error::ok) return;
  enumerating_ = q.timeout_s != protocols::EnumerationBegin::kCancel;
  enumeration_end_us_ =
      q.timeout_s == protocols::EnumerationBegin::kForever ? ~std::uint64_t{0} : now_us + q.timeout_s * std::uint64_t{1'000'000};
}

void EscNode::on_update(const protocols::Transfer& t, std::uint64_t now_us) {
  using Response = protocols::BeginFirmwareUpdateResponse;
  protocols::BeginFirmwareUpdate q;
  if (!decode(t.payload, q)) {
    ++counters_.undecodable;
    return;
  }
  Response r;
  if (busy(now_us)) {
    ++counters_.refused_while_running;
    r.error = Response::Error::invalid_mode;
    r.message = protocols::Text<127>("the motor is running");
  } else if (request_ != NodeRequest::none) {
    r.error = Response::Error::in_progress;
  } else if (q.path.path.count == 0 || t.payload.size() > 1 + protocols::FilePath::kMostBytes || q.source_node_id > 127) {
    r.error = Response::Error::unknown;  // the decoder takes the bytes that a path has room for: the payload's size tells of more
    r.message = protocols::Text<127>("no path of 1 to 200 bytes, or no such file server");
  }
  if (!respond(t, r, now_us) || r.error != Response::Error::ok) return;
  update_ = {.server = q.source_node_id == 0 ? t.id.source : q.source_node_id, .own_id = node_id_, .path = q.path.path};
  request_ = NodeRequest::update;
  request_us_ = now_us;
}

}  // namespace rotorloop::firmware
