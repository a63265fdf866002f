#include "host/node/esc_link.hpp"

namespace rotorloop::host {
namespace {

namespace pr = protocols;
constexpr std::int64_t kNodeStatusPeriod_us = 1'000'000;
constexpr std::int64_t kArmingPeriod_us = 500'000;
constexpr std::uint8_t kCommandPriority = 6, kArmingPriority = 8, kStatusPriority = 20;
constexpr std::array<pr::Subscription, 2> kSubscriptions{pr::subscribe(pr::TransferKind::message, pr::NodeStatus::kType),
                                                         pr::subscribe(pr::TransferKind::message, pr::EscStatus::kType)};
constexpr double kRadPerSecondPerRpm = 0.10471975511965977;

}  // namespace

EscLink::EscLink(const EscLinkConfig& config, CanBus& port) : config_(config), port_(port), receiver_(config.node_id, kSubscriptions) {}

int EscLink::index_of(std::uint8_t node) const {
  for (std::size_t i = 0; i < kRotors; ++i)
    if (config_.esc_node_ids[i] == node) return static_cast<int>(i);
  return -1;
}

void EscLink::on_frame(const CanFrame& frame, std::int64_t now_us) {
  if (!frame.extended) {
    const auto feedback = pr::fast::decode_feedback(frame);
    if (!feedback) return;
    if (feedback->esc_index >= kRotors) {
      ++counters_.foreign;
      return;
    }
    EscState& e = escs_[feedback->esc_index];
    e.speed_rad_s = static_cast<double>(feedback->speed_rad_s());
    e.current_A = static_cast<double>(feedback->current_A());
    if (feedback->bus_10mV) e.bus_V = 0.01 * *feedback->bus_10mV;
    e.heard_us = now_us;
    ++counters_.feedback;
    int& last = last_sequence_[feedback->esc_index];
    if (last >= 0) {
      const int ahead = pr::fast::sequence_ahead(feedback->sequence, static_cast<std::uint8_t>(last));
      if (ahead > 1) counters_.sequence_lost += static_cast<std::uint64_t>(ahead - 1);
    }
    last = feedback->sequence;
  } else if (const auto transfer = receiver_.accept(frame, static_cast<std::uint64_t>(now_us))) {
    on_transfer(*transfer, now_us);
  }
}

void EscLink::on_transfer(const pr::Transfer& t, std::int64_t now_us) {
  const int index = index_of(t.id.source);
  if (index < 0) return;
  EscState& e = escs_[static_cast<std::size_t>(index)];
  if (t.id.data_type_id == pr::NodeStatus::kType.id) {
    pr::NodeStatus s;
    if (!decode(t.payload, s)) return;
    e.node_heard_us = now_us;
    e.operational = s.mode == pr::NodeMode::operational && s.health <= pr::Health::warning;
    e.fault = s.health >= pr::Health::error;
  } else if (t.id.data_type_id == pr::EscStatus::kType.id) {
    pr::EscStatus s;
    if (!decode(t.payload, s) || s.esc_index != index) return;
    e.bus_A = static_cast<double>(s.current_A);
    e.bus_V = static_cast<double>(s.voltage_V);
    if (!config_.fast_channel) {
      e.speed_rad_s = s.rpm * kRadPerSecondPerRpm;
      e.heard_us = now_us;
    }
  }
}

int EscLink::first_missing(std::int64_t now_us) const {
  for (std::size_t i = 0; i < kRotors; ++i)
    if (!escs_[i].operational || now_us - escs_[i].node_heard_us > config_.node_timeout_us) return static_cast<int>(i);
  return -1;
}

void EscLink::send_message(const pr::DataType& type, std::uint8_t priority, pr::TransferIdCounter& id, std::span<const std::uint8_t> payload) {
  pr::encode_transfer({.kind = pr::TransferKind::message, .priority = priority, .data_type_id = type.id, .source = config_.node_id},
                      type.crc_seed(), id.next(), payload, [this](const CanFrame& f) {
                        send(f);
                        return true;
                      });
}

void EscLink::poll(std::int64_t now_us) {
  if (now_us >= next_node_status_us_) {
    next_node_status_us_ = now_us + kNodeStatusPeriod_us;
    std::array<std::uint8_t, pr::NodeStatus::kMaxBytes> payload{};
    const std::size_t size = encode(pr::NodeStatus{.uptime_s = static_cast<std::uint32_t>(now_us / 1'000'000),
                                                   .health = pr::Health::ok,
                                                   .mode = pr::NodeMode::operational,
                                                   .vendor_status = 0},
                                    payload);
    send_message(pr::NodeStatus::kType, kStatusPriority, node_status_id_, {payload.data(), size});
  }
  if (now_us >= next_arming_us_ || armed_ != arming_sent_as_) {
    next_arming_us_ = now_us + kArmingPeriod_us;
    arming_sent_as_ = armed_;
    std::array<std::uint8_t, pr::ArmingStatus::kMaxBytes> payload{};
    const std::size_t size = encode(pr::ArmingStatus{.status = armed_ ? pr::ArmingStatus::kFullyArmed : pr::ArmingStatus::kDisarmed}, payload);
    send_message(pr::ArmingStatus::kType, kArmingPriority, arming_id_, {payload.data(), size});
  }
}

void EscLink::command(const std::array<double, kRotors>& omega_rad_s, std::int64_t) {
  ++counters_.commands;
  if (config_.fast_channel) {
    setpoint_.sequence = static_cast<std::uint8_t>((setpoint_.sequence + 1) % pr::fast::kSequenceModulo);
    for (std::size_t i = 0; i < kRotors; ++i) setpoint_.set(static_cast<int>(i), static_cast<float>(omega_rad_s[i]));
    send(pr::fast::encode(setpoint_));
    return;
  }
  pr::RpmCommand command;
  command.count = kRotors;
  for (std::size_t i = 0; i < kRotors; ++i)
    command.rpm[i] = static_cast<std::int32_t>(std::floor(omega_rad_s[i] / kRadPerSecondPerRpm + 0.5));
  std::array<std::uint8_t, pr::RpmCommand::kMaxBytes> payload{};
  const std::size_t size = encode(command, payload);
  send_message(pr::RpmCommand::kType, kCommandPriority, rpm_id_, {payload.data(), size});
}

}  // namespace rotorloop::host
