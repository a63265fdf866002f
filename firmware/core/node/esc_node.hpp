// The ESC as a node on the CAN bus: DroneCAN (identity, commands, telemetry, parameters, allocation, enumeration, restart, hand-off to
// an update) and the fast channel. Owns no hardware and no clock: the application hands in received frames and telemetry with the
// time, takes frames to send, and asks for the set-point. All memory is in the object.
//   loop: up to kFramesPerPoll times: if (frame) node.on_frame(frame, now);
//         node.on_commissioning(result, …); node.poll(now, telemetry); while (mailbox free) send(node.next_frame());
//         what needs hardware: node.request() and node.complete() (save, erase, restart, update); node.commissioning_order()
//   control loop: motor.step(node.setpoint(now))
// Feedback of the fast channel leaves with the poll() after its set-point, so that it carries that poll's telemetry: poll at
// once after handing in frames. poll() at least every 10 ms; on_frame() and poll() from the same context.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "firmware/core/interface.hpp"
#include "firmware/core/node/allocation_client.hpp"
#include "firmware/core/node/command_input.hpp"
#include "firmware/core/node/commission_service.hpp"
#include "firmware/core/node/frame_buffer.hpp"
#include "firmware/core/node/main_loop.hpp"
#include "firmware/core/node/node_report.hpp"
#include "firmware/core/node/parameter_server.hpp"
#include "firmware/core/node/parameter_store.hpp"
#include "firmware/core/node/parameters.hpp"
#include "firmware/core/node/transmit_queue.hpp"
#include "protocols/can_frame.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/receiver.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::firmware {

// What GetNodeInfo answers, and options that are not parameters.
struct NodeIdentity {
  const char* name = "org.rotorloop.esc";
  std::uint8_t software_major = 0, software_minor = 1;
  std::uint32_t vcs_commit = 0;  // 0: not known
  std::uint64_t image_crc = 0;   // 0: not known
  std::uint8_t hardware_major = 1, hardware_minor = 0;
  std::array<std::uint8_t, 16> unique_id{};     // constant per board; autopilots refuse two nodes with the same one
  std::span<const std::uint8_t> certificate{};  // of authenticity, at most 255 bytes; outlives the node
  bool feedback_with_voltage = false;           // 6-byte feedback frames, whatever the parameter says
};

struct NodeCounters {
  std::uint32_t frames = 0;                 // handed in
  std::uint32_t fast_malformed = 0;         // set-point id with a wrong length or the reserved mode
  std::uint32_t fast_disabled = 0;          // set-points while the fast channel is off by parameter
  std::uint32_t fast_version = 0;           // set-points refused for the version of their sender
  std::uint32_t payload_wrong_size = 0;     // an ArmingStatus without its byte, or with more than it that would arm
  std::uint32_t undecodable = 0;            // requests too short for their fields
  std::uint32_t tx_overflow = 0;            // transfers given up because the queue was full
  std::uint32_t service_overflow = 0;       // frames of requests that came faster than they are answered
  std::uint32_t tx_expired = 0;             // frames that waited for the bus longer than a second
  std::uint32_t feedback_superseded = 0;    // a feedback frame replaced before it could be sent: the bus is too busy
  std::uint32_t refused_while_running = 0;  // save, erase, restart, update or enumeration while the motor turns
  std::uint32_t id_conflicts = 0;           // frames that carry our own node id
  std::uint32_t index_conflicts = 0;        // feedback or esc.Status of another ESC with our index
  std::uint32_t logs_dropped = 0;           // log messages beyond a few a second
};

// What the application has to do for the bus, because it needs hardware.
enum class NodeRequest : std::uint8_t {
  none,
  save,     // store().save(node.edited()), then complete(ok)
  erase,    // store the defaults, then complete(ok)
  restart,  // the answer has left: reset
  update,   // the answer has left: keep update(), reset into the updater
};

struct UpdateRequest {
  std::uint8_t server = 0;  // node id of the file server
  std::uint8_t own_id = 0;
  protocols::Text<200> path{};
};

class EscNode {
 public:
  // Parameters that contradict their ranges are not used: the node speaks on defaults, says which one is wrong, and never spins.
  EscNode(const Parameters& p, const NodeIdentity& identity, const NodeRules& rules = {})
      : problem_(check(p)),
        p_(problem_ ? speaking_defaults(p) : p),
        edited_(p_),
        at_start_(p_),
        identity_(identity),
        node_id_(p_.node_id),
        receiver_(node_id_, kMessages),
        services_(node_id_, kServices),
        input_(p_, rules),
        allocation_(identity.unique_id, p_.preferred_id) {
    if (problem_) wrong_value_ = *problem_;
  }

  // How the store was found; without a whole page the node speaks on defaults and never spins until parameters were saved.
  void report_store(StoreState state) { store_ = state; }

  // Said once as a warning, as soon as the node speaks: what the board has to tell of its last run.
  void report_at_start(const TextLine& text) { start_report_ = text; }

  void on_frame(const CanFrame& frame, std::uint64_t now_us);
  void poll(std::uint64_t now_us, const Telemetry& t);

  // How far firmware/core/commission is, at every poll; switch_ohm: the board's share of a phase's resistance.
  void on_commissioning(const CommissioningResult& result, float switch_ohm) { commission_.take(result, switch_ohm); }
  CommissioningOrder commissioning_order() const { return commission_.order(); }
  bool commissioning() const { return commission_.active(); }

  // The user has pressed the button of this ESC: it is the one that is enumerated now. Without an enumeration it means nothing.
  void on_button() { button_ = true; }
  // Its rotor was turned by hand (firmware/core/motor/hand_watch.hpp), which is asked for while feels_for_hand() and at no other time.
  void on_hand(bool turned) { hand_ = turned; }
  bool feels_for_hand() const {
    return enumerating_ && last_poll_us_ <= enumeration_end_us_ && telemetry_.state == MotorState::off && !led(last_poll_us_) &&
           setpoint(last_poll_us_).mode == Mode::off && request_ == NodeRequest::none;
  }
  bool enumerating() const { return enumerating_; }

  // The application is not ready (offset calibration, self-test): NodeStatus says initialization and the motor stays off.
  void hold_initialization(bool hold) {
    held_ = hold;
    if (hold) mode_ = protocols::NodeMode::initialization;
  }

  std::optional<CanFrame> next_frame() { return queue_.pop(); }

  // Off unless armed, operational and fresh. Const and cheap: for the control loop.
  Setpoint setpoint(std::uint64_t now_us) const {
    if (!may_spin()) return {};
    const Setpoint s = input_.setpoint(now_us);
    // A tone turns nothing; it is for motors that nobody has armed.
    if (s.mode == Mode::off && !input_.armed() && now_us < beep_until_us_) return {Mode::tone, beep_Hz_};
    return s;
  }

  // What is left to do for the bus; restart and update not before their answer has left (or could not for 100 ms).
  NodeRequest request() const {
    const bool answered = request_ != NodeRequest::restart && request_ != NodeRequest::update;
    return answered || queue_.size() == 0 || last_poll_us_ - request_us_ > kAnswerLeaves_us ? request_ : NodeRequest::none;
  }
  const UpdateRequest& update() const { return update_; }
  // After a save or an erase.
  void complete(bool ok) {
    if (request_ != NodeRequest::save && request_ != NodeRequest::erase) return;
    if (ok && request_ == NodeRequest::erase) {
      edited_ = Parameters{};
      edited_new_ = true;
    }
    if (ok) {
      problem_.reset();
      store_ = StoreState::loaded;
    }
    answer_opcode(ok);
    request_ = NodeRequest::none;
  }

  bool parameters_ok() const { return !problem_ && store_ == StoreState::loaded; }
  // In force, but for those of InForce::at_start: the motor control has its constants from the start, and what was set since waits for a
  // restart (stat_restart names it). A new revision after each change.
  const Parameters& parameters() const { return p_; }
  std::uint32_t revision() const { return revision_; }
  // As the bus has set them; in force once the motor is off.
  const Parameters& edited() const { return edited_; }
  std::uint8_t node_id() const { return node_id_; }  // 0: not yet allocated
  bool armed() const { return parameters_ok() && input_.armed(); }
  protocols::NodeMode mode() const { return mode_; }
  protocols::Health health() const;
  WhyOff why_off(std::uint64_t now_us) const;
  const FaultLog& faults() const { return faults_; }
  const NodeCounters& counters() const { return counters_; }
  const CommandCounters& command_counters() const { return input_.counters(); }
  const protocols::ReceiverCounters& receiver_counters() const { return receiver_.counters(); }
  const protocols::ReceiverCounters& service_counters() const { return services_.counters(); }

 private:
  using Kind = protocols::TransferKind;
  using Level = protocols::LogMessage::Level;
  static constexpr std::uint64_t kNodeStatusMinimum_us = 50'000;  // between two, when health or mode change
  static constexpr std::uint64_t kAnswerLeaves_us = 100'000;
  static constexpr std::uint64_t kRequestTimeout_us = 500'000;  // DroneCAN: a server answers within 0.5 s
  static constexpr std::uint64_t kSilence_us = 3'000'000;       // after a frame with our id: DroneCAN calls us offline then
  static constexpr std::uint64_t kBlockedReport_us = 2'000'000;
  static constexpr std::uint64_t kVersionCounts_us = 1'500'000;  // hosts repeat theirs every second: one stray frame stops nothing for long
  static constexpr std::uint8_t kNodeStatusPriority = 20, kLogPriority = 28, kIndicationPriority = 24;
  // Five answers to GetSet, which a configuration tool asks for at once, have 6 to 20 frames each.
  static constexpr std::size_t kQueue = 64, kReservedForTelemetry = 8, kSmallestAnswer = 1;
  static constexpr std::array kMessages{protocols::subscribe(Kind::message, protocols::RawCommand::kType),
                                        protocols::subscribe(Kind::message, protocols::RpmCommand::kType),
                                        protocols::subscribe(Kind::message, protocols::ArmingStatus::kType),
                                        protocols::subscribe(Kind::message, protocols::EscStatus::kType),
                                        protocols::subscribe(Kind::message, protocols::Allocation::kType),
                                        protocols::subscribe(Kind::message, protocols::BeepCommand::kType)};
  static constexpr std::array kServices{protocols::subscribe(Kind::request, protocols::GetNodeInfo::kType),
                                        protocols::subscribe(Kind::request, protocols::ParamGetSet::kType),
                                        protocols::subscribe(Kind::request, protocols::ParamExecuteOpcode::kType),
                                        protocols::subscribe(Kind::request, protocols::RestartNode::kType),
                                        protocols::subscribe(Kind::request, protocols::EnumerationBegin::kType),
                                        protocols::subscribe(Kind::request, protocols::BeginFirmwareUpdate::kType)};

  // Ours where they are right by themselves: the node keeps its place on the bus.
  static Parameters speaking_defaults(const Parameters& p) {
    Parameters d;
    if (p.node_id <= 125) d.node_id = p.node_id;
    if (p.esc_index <= 15) d.esc_index = p.esc_index;
    return d;
  }

  bool may_spin() const {
    return parameters_ok() && mode_ == protocols::NodeMode::operational && !commission_.active() && request_ != NodeRequest::restart &&
           request_ != NodeRequest::update;
  }
  bool turning() const {
    return telemetry_.state != MotorState::off && telemetry_.state != MotorState::fault && telemetry_.state != MotorState::tone;
  }
  bool busy(std::uint64_t now_us) const {
    return turning() || commission_.active() || (setpoint(now_us).mode != Mode::off && setpoint(now_us).mode != Mode::tone);
  }
  // Somebody is about to turn the motor, or does: no time to feel for a hand.
  bool led(std::uint64_t now_us) const { return busy(now_us) || (p_.require_arming && input_.armed()); }
  bool speaks(std::uint64_t now_us) const { return node_id_ != 0 && now_us >= silent_until_us_; }

  void on_standard_frame(const CanFrame& frame, std::uint64_t now_us);
  void on_own_id(std::uint64_t now_us);
  void on_own_index(std::uint64_t now_us);
  void on_message(const protocols::Transfer& t, std::uint64_t now_us);
  void on_arming(const protocols::Transfer& t);
  void on_beep(const protocols::Transfer& t, std::uint64_t now_us);
  void on_allocation(const protocols::Transfer& t, std::uint64_t now_us);
  void serve_one_request(std::uint64_t now_us);
  void on_request(const protocols::Transfer& t, std::uint64_t now_us);
  void on_get_set(const protocols::Transfer& t, std::uint64_t now_us);
  void on_opcode(const protocols::Transfer& t, std::uint64_t now_us);
  void on_restart(const protocols::Transfer& t, std::uint64_t now_us);
  void on_enumeration(const protocols::Transfer& t, std::uint64_t now_us);
  void on_update(const protocols::Transfer& t, std::uint64_t now_us);

  void order_commission(std::int32_t task, std::uint8_t source, std::uint64_t now_us);
  const char* why_no_commission(std::uint64_t now_us) const;
  void watch_commission(std::uint64_t now_us);
  void take_commission(std::uint64_t now_us);
  protocols::NodeMode shown_mode() const { return commission_.active() ? protocols::NodeMode::maintenance : mode_; }

  void watch_motor(std::uint64_t now_us, const Telemetry& t);
  void watch_enumeration(std::uint64_t now_us);
  void watch_commanders(std::uint64_t now_us);
  void report_why(std::uint64_t now_us);
  void report_problem(std::uint64_t now_us);
  protocols::NodeStatus node_status(std::uint64_t now_us) const;
  void answer_node_info(const protocols::Transfer& request, std::uint64_t now_us);
  void answer_opcode(bool ok);
  void send_node_status(std::uint64_t now_us);
  void send_telemetry(std::uint64_t now_us);
  void send_status(std::uint64_t now_us);
  void send_extended(std::uint64_t now_us);
  void send_feedback(std::uint64_t now_us);
  void say(Level level, const TextLine& text, std::uint64_t now_us);

  static bool due(std::uint64_t& next_us, std::uint64_t period_us, std::uint64_t now_us) {
    if (now_us < next_us) return false;
    next_us = now_us - next_us < period_us ? next_us + period_us : now_us + period_us;
    return true;
  }
  template <class T>
  bool send_message(const T& value, std::uint8_t priority, protocols::TransferIdCounter& id, std::uint64_t now_us) {
    return send({.kind = Kind::message, .priority = priority, .data_type_id = T::kType.id, .source = node_id_}, id.next(), value, 0,
                now_us);
  }
  template <class T>
  bool respond(const protocols::Transfer& request, const T& value, std::uint64_t now_us) {
    return send({.kind = Kind::response,
                 .priority = request.id.priority,
                 .data_type_id = T::kType.id,
                 .source = node_id_,
                 .destination = request.id.source},
                request.transfer_id, value, kReservedForTelemetry, now_us);
  }
  // All frames of a transfer or none.
  template <class T>
  bool send(const protocols::FrameId& header, std::uint8_t transfer_id, const T& value, std::size_t keep_free, std::uint64_t now_us) {
    static constexpr std::uint16_t kSeed = T::kType.crc_seed();
    std::array<std::uint8_t, protocols::max_bytes<T>()> payload;  // written up to `size`
    const std::size_t size = encode(value, payload);
    if (queue_.room() < protocols::transfer_frames(static_cast<std::uint32_t>(size)) + keep_free) {
      ++counters_.tx_overflow;
      return false;
    }
    return protocols::encode_transfer(header, kSeed, transfer_id, {payload.data(), size},
                                      [&](const CanFrame& f) { return queue_.push(f, now_us); });
  }

  std::optional<ParameterError> problem_;
  ParameterError wrong_value_{};      // what to say of it
  Parameters p_, edited_, at_start_;  // in force, as set, at the start
  NodeIdentity identity_;
  std::uint8_t node_id_;
  StoreState store_ = StoreState::loaded;
  protocols::Receiver<16, 46> receiver_;
  protocols::Receiver<4, 224> services_;
  FrameBuffer<32> service_frames_;  // the longest request, BeginFirmwareUpdate, has 30
  CommandInput input_;
  AllocationClient allocation_;
  CommissionService commission_;
  TransmitQueue<kQueue> queue_;
  NodeCounters counters_;
  Telemetry telemetry_;
  FaultLog faults_;
  TextLine start_report_;
  UpdateRequest update_;
  protocols::Transfer opcode_request_{};  // its payload is not kept
  protocols::TransferIdCounter node_status_id_, status_id_, extended_id_, rpm_id_, log_id_, indication_id_;
  protocols::Text<protocols::kMaxParameterName> enumerated_{};
  NodeRequest request_ = NodeRequest::none;
  protocols::NodeMode mode_ = protocols::NodeMode::initialization, sent_mode_ = protocols::NodeMode::initialization;
  protocols::Health sent_health_ = protocols::Health::ok;
  WhyOff reported_why_ = WhyOff::turning;
  std::uint64_t start_us_ = 0, next_node_status_us_ = 0, sent_node_status_us_ = 0, next_status_us_ = 0, next_extended_us_ = 0,
                next_rpm_us_ = 0, last_poll_us_ = 0, request_us_ = 0, silent_until_us_ = 0, index_conflict_us_ = 0, trip_us_ = 0,
                enumeration_end_us_ = 0, next_why_us_ = 0, log_allowance_us_ = 0, fast_version_us_ = 0, beep_until_us_ = 0,
                opcode_argument_ = 0;
  std::uint32_t revision_ = 0;
  float beep_Hz_ = 0.0f;
  std::uint8_t fast_version_ = 0, reported_second_ = 0;  // version: 0 none heard
  bool started_ = false, held_ = false, sent_node_status_ = false, feedback_due_ = false, edited_new_ = false, enumerating_ = false,
       id_conflict_ = false, index_conflict_ = false, tripped_ = false, problem_reported_ = false, conflict_reported_ = false,
       button_ = false, hand_ = false;
};

}  // namespace rotorloop::firmware
