// The ESC as a node on the CAN bus: DroneCAN (NodeStatus, GetNodeInfo, RawCommand, RPMCommand, ArmingStatus, esc.Status) and
// the fast channel. Owns no hardware and no clock: the application hands in received frames and telemetry with the time, takes
// frames to send, and asks for the set-point. All memory is in the object.
//   loop: while (frame) node.on_frame(frame, now); node.poll(now, telemetry); while (mailbox free) send(node.next_frame());
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
#include "firmware/core/node/command_input.hpp"
#include "firmware/core/node/frame_queue.hpp"
#include "firmware/core/node/parameters.hpp"
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
  std::uint8_t hardware_major = 1, hardware_minor = 0;
  std::array<std::uint8_t, 16> unique_id{};  // constant per board; autopilots refuse two nodes with the same one
  bool feedback_with_voltage = false;        // 6-byte feedback frames
};

struct NodeCounters {
  std::uint32_t frames = 0;               // handed in
  std::uint32_t fast_malformed = 0;       // set-point id with a wrong length or the reserved mode
  std::uint32_t fast_disabled = 0;        // set-points while the fast channel is off by parameter
  std::uint32_t payload_wrong_size = 0;   // an ArmingStatus without its byte, or with more than it that would arm
  std::uint32_t tx_overflow = 0;          // transfers given up because the queue was full
  std::uint32_t feedback_superseded = 0;  // a feedback frame replaced before it could be sent: the bus is too busy
  std::uint32_t refused_parameters = 0;   // frames ignored because the parameters are out of range
};

template <NodeRules kRules>
class BasicEscNode {
 public:
  BasicEscNode(const Parameters& p, const NodeIdentity& identity)
      : p_(p), identity_(identity), parameters_ok_(!check(p).has_value()), receiver_(p.node_id, kSubscriptions), input_(p) {}

  void on_frame(const CanFrame& frame, std::uint64_t now_us) {
    ++counters_.frames;
    if (!parameters_ok_) {
      ++counters_.refused_parameters;
      return;
    }
    input_.on_other_traffic(now_us);
    if (!frame.extended) {
      on_standard_frame(frame, now_us);
    } else if (const auto transfer = receiver_.accept(frame, now_us)) {
      on_transfer(*transfer, now_us);
    }
  }

  void poll(std::uint64_t now_us, const Telemetry& t) {
    if (!parameters_ok_) return;  // without a valid node id there is nothing it may send
    input_.expire(now_us);
    if (!started_) {
      started_ = true;
      start_us_ = next_node_status_us_ = now_us;
      // ESCs switched on together spread their multi-frame telemetry over the period.
      next_status_us_ = now_us + kIdleStatusPeriod_us * p_.esc_index / 16u;
    } else if (!held_ && mode_ == protocols::NodeMode::initialization) {
      mode_ = protocols::NodeMode::operational;
    }
    telemetry_ = t;
    send_node_status(now_us);
    send_status(now_us);
    if (feedback_due_) send_feedback();
  }

  // The application is not ready (offset calibration, self-test): NodeStatus says initialization and the motor stays off.
  void hold_initialization(bool hold) {
    held_ = hold;
    if (hold) mode_ = protocols::NodeMode::initialization;
  }

  std::optional<CanFrame> next_frame() { return queue_.pop(); }

  // Off unless armed, operational and fresh. Const and cheap: for the control loop.
  Setpoint setpoint(std::uint64_t now_us) const {
    if (!parameters_ok_ || mode_ != protocols::NodeMode::operational) return {};
    return input_.setpoint(now_us);
  }

  bool parameters_ok() const { return parameters_ok_; }
  bool armed() const { return parameters_ok_ && input_.armed(); }
  protocols::NodeMode mode() const { return mode_; }
  protocols::Health health() const {
    if (telemetry_.fault != Fault::none) return protocols::Health::error;
    return telemetry_.limiter == Limiter::temperature ? protocols::Health::warning : protocols::Health::ok;
  }
  const NodeCounters& counters() const { return counters_; }
  const CommandCounters& command_counters() const { return input_.counters(); }
  const protocols::ReceiverCounters& receiver_counters() const { return receiver_.counters(); }

 private:
  using Kind = protocols::TransferKind;
  static constexpr std::uint64_t kNodeStatusPeriod_us = 1'000'000;  // DroneCAN: 2..1000 ms
  static constexpr std::uint64_t kNodeStatusMinimum_us = 50'000;    // between two, when health or mode change
  static constexpr std::uint64_t kIdleStatusPeriod_us = 500'000;
  static constexpr std::uint8_t kStatusPriority = 16, kNodeStatusPriority = 20;
  static constexpr std::size_t kQueue = 32, kReservedForTelemetry = 8;
  static constexpr std::array<protocols::Subscription, 4> kSubscriptions{
      protocols::subscribe(Kind::message, protocols::RawCommand::kType), protocols::subscribe(Kind::message, protocols::RpmCommand::kType),
      protocols::subscribe(Kind::message, protocols::ArmingStatus::kType),
      protocols::subscribe(Kind::request, protocols::GetNodeInfo::kType)};
  static constexpr std::uint16_t kStatusSeed = protocols::EscStatus::kType.crc_seed(),
                                 kNodeStatusSeed = protocols::NodeStatus::kType.crc_seed(),
                                 kNodeInfoSeed = protocols::GetNodeInfo::kType.crc_seed();

  void on_standard_frame(const CanFrame& frame, std::uint64_t now_us) {
    namespace fast = protocols::fast;
    if (!fast::is_setpoint_id(frame) || (frame.id & 3u) != p_.esc_index / 4u) return;
    if (!p_.fast_channel) {
      ++counters_.fast_disabled;
      return;
    }
    const auto s = fast::decode_setpoint(frame);
    if (!s) {
      ++counters_.fast_malformed;
      return;
    }
    if (!input_.on_fast(*s, now_us)) return;
    // By sequence number and not by a counter of its own: all ESCs answer the same set-points.
    if (p_.fast_feedback_Hz > 0 && s->sequence % (1000u / p_.fast_feedback_Hz) == 0) feedback_due_ = true;
  }

  void on_transfer(const protocols::Transfer& t, std::uint64_t now_us) {
    switch (t.id.data_type_id) {
      case protocols::RawCommand::kType.id: {
        protocols::RawCommand c;
        decode(t.payload, c);
        input_.on_raw(c, now_us);
        break;
      }
      case protocols::RpmCommand::kType.id: {
        protocols::RpmCommand c;
        decode(t.payload, c);
        input_.on_rpm(c, now_us);
        break;
      }
      case protocols::ArmingStatus::kType.id: {
        protocols::ArmingStatus a;
        // Arming is taken only in exactly its form; a longer transfer that happens to begin with 255 is not an order to arm.
        if (!decode(t.payload, a) ||
            (a.status == protocols::ArmingStatus::kFullyArmed && t.payload.size() != protocols::ArmingStatus::kMaxBytes)) {
          ++counters_.payload_wrong_size;
        } else {
          input_.on_arming(a.status);
        }
        break;
      }
      case protocols::GetNodeInfo::kType.id:
        answer_node_info(t, now_us);
        break;
      default:
        break;
    }
  }

  protocols::NodeStatus node_status(std::uint64_t now_us) const {
    return {.uptime_s = static_cast<std::uint32_t>((now_us - start_us_) / 1'000'000u),
            .health = health(),
            .mode = mode_,
            .vendor_status =
                static_cast<std::uint16_t>(static_cast<unsigned>(telemetry_.fault) | static_cast<unsigned>(telemetry_.limiter) << 8)};
  }

  void answer_node_info(const protocols::Transfer& request, std::uint64_t now_us) {
    protocols::GetNodeInfoResponse r;
    r.status = node_status(now_us);
    r.software_major = identity_.software_major;
    r.software_minor = identity_.software_minor;
    r.software_flags = identity_.vcs_commit != 0 ? 1 : 0;
    r.vcs_commit = identity_.vcs_commit;
    r.hardware_major = identity_.hardware_major;
    r.hardware_minor = identity_.hardware_minor;
    r.unique_id = identity_.unique_id;
    r.set_name(identity_.name);
    std::array<std::uint8_t, 41 + protocols::GetNodeInfoResponse::kMaxName> payload{};
    const std::size_t size = encode(r, payload);
    send({.kind = Kind::response,
          .priority = request.id.priority,
          .data_type_id = protocols::GetNodeInfo::kType.id,
          .source = p_.node_id,
          .destination = request.id.source},
         kNodeInfoSeed, request.transfer_id, {payload.data(), size}, kReservedForTelemetry);
  }

  void send_node_status(std::uint64_t now_us) {
    const bool changed = !sent_node_status_ || health() != sent_health_ || mode_ != sent_mode_;
    const bool allowed = !sent_node_status_ || now_us - sent_node_status_us_ >= kNodeStatusMinimum_us;
    if (now_us < next_node_status_us_ && !(changed && allowed)) return;
    std::array<std::uint8_t, protocols::NodeStatus::kMaxBytes> payload{};
    const std::size_t size = encode(node_status(now_us), payload);
    if (!send_message(protocols::NodeStatus::kType.id, kNodeStatusSeed, kNodeStatusPriority, node_status_id_, {payload.data(), size}))
      return;
    sent_node_status_ = true;
    sent_node_status_us_ = now_us;
    sent_health_ = health();
    sent_mode_ = mode_;
    next_node_status_us_ = now_us + kNodeStatusPeriod_us;
  }

  void send_status(std::uint64_t now_us) {
    const bool running = telemetry_.state != MotorState::off;
    const std::uint64_t period_us = running ? 1'000'000u / p_.status_Hz : kIdleStatusPeriod_us;
    if (next_status_us_ > now_us + period_us) next_status_us_ = now_us + period_us;  // the motor started: no waiting for the idle period
    if (now_us < next_status_us_) return;
    next_status_us_ = now_us - next_status_us_ < period_us ? next_status_us_ + period_us : now_us + period_us;
    protocols::EscStatus s;
    s.error_count = telemetry_.error_count;
    s.voltage_V = telemetry_.bus_V;
    s.current_A = telemetry_.bus_A;
    s.temperature_K = telemetry_.temperature_K;
    s.rpm = telemetry_.speed_valid
                ? protocols::fast::quantise(telemetry_.speed_rad_s, protocols::fast::kRadPerSecondPerRpm, -131071, 131071)
                : 0;
    s.power_rating_pct =
        static_cast<std::uint8_t>(protocols::fast::quantise(std::fabs(telemetry_.bus_A), p_.bus_current_limit_A / 100.0f, 0, 127));
    s.esc_index = p_.esc_index;
    std::array<std::uint8_t, protocols::EscStatus::kMaxBytes> payload{};
    const std::size_t size = encode(s, payload);
    send_message(protocols::EscStatus::kType.id, kStatusSeed, kStatusPriority, status_id_, {payload.data(), size});
  }

  void send_feedback() {
    feedback_due_ = false;
    protocols::fast::Feedback f;
    f.esc_index = p_.esc_index;
    f.sequence = input_.fast_sequence();
    f.set_speed_rad_s(telemetry_.speed_valid ? telemetry_.speed_rad_s : std::numeric_limits<float>::quiet_NaN());
    f.set_current_A(telemetry_.current_q_A);
    if (identity_.feedback_with_voltage) f.set_bus_V(telemetry_.bus_V);
    const CanFrame frame = encode(f);
    if (queue_.replace(frame)) {
      ++counters_.feedback_superseded;
    } else if (!queue_.push(frame)) {
      ++counters_.tx_overflow;
    }
  }

  bool send_message(std::uint16_t type, std::uint16_t seed, std::uint8_t priority, protocols::TransferIdCounter& id,
                    std::span<const std::uint8_t> payload) {
    return send({.kind = Kind::message, .priority = priority, .data_type_id = type, .source = p_.node_id}, seed, id.next(), payload, 0);
  }

  // All frames of a transfer or none.
  bool send(const protocols::FrameId& header, std::uint16_t seed, std::uint8_t transfer_id, std::span<const std::uint8_t> payload,
            std::size_t keep_free) {
    if (queue_.room() < protocols::transfer_frames(static_cast<std::uint32_t>(payload.size())) + keep_free) {
      ++counters_.tx_overflow;
      return false;
    }
    return protocols::encode_transfer(header, seed, transfer_id, payload, [this](const CanFrame& f) { return queue_.push(f); });
  }

  Parameters p_;
  NodeIdentity identity_;
  bool parameters_ok_;
  protocols::Receiver<12, protocols::RpmCommand::kMaxBytes> receiver_;
  CommandInput<kRules> input_;
  FrameQueue<kQueue> queue_;
  NodeCounters counters_;
  Telemetry telemetry_;
  protocols::TransferIdCounter node_status_id_, status_id_;
  protocols::NodeMode mode_ = protocols::NodeMode::initialization, sent_mode_ = protocols::NodeMode::initialization;
  protocols::Health sent_health_ = protocols::Health::ok;
  std::uint64_t start_us_ = 0, next_node_status_us_ = 0, sent_node_status_us_ = 0, next_status_us_ = 0;
  bool started_ = false, held_ = false, sent_node_status_ = false, feedback_due_ = false;
};

inline constexpr NodeRules kAllRules{};
using EscNode = BasicEscNode<kAllRules>;
extern template class BasicEscNode<kAllRules>;

}  // namespace rotorloop::firmware
