#include "host/node/dronecan_node.hpp"

#include <algorithm>
#include <cmath>

namespace rotorloop::host {

using protocols::ArmingStatus;
using protocols::DataType;
using protocols::EscStatus;
using protocols::FrameId;
using protocols::GetNodeInfo;
using protocols::GetNodeInfoResponse;
using protocols::NodeStatus;
using protocols::RawCommand;
using protocols::RpmCommand;
using protocols::TransferKind;

namespace {

constexpr std::array<protocols::Subscription, 4> kSubscriptions{
    protocols::subscribe(TransferKind::message, NodeStatus::kType), protocols::subscribe(TransferKind::message, EscStatus::kType),
    protocols::subscribe(TransferKind::request, GetNodeInfo::kType), protocols::subscribe(TransferKind::response, GetNodeInfo::kType)};

// Commands above arming, arming above identity; autopilots send commands at 0..7 (docs/wire.md §2).
constexpr std::uint8_t kCommandPriority = 7, kArmingPriority = 8, kStatusPriority = 20, kRequestPriority = 24;
constexpr std::int64_t kStatusPeriod_us = 1'000'000, kArmingPeriod_us = 500'000;
constexpr std::int64_t kVersionPeriod_us = 1'000'000;
constexpr std::int64_t kRequestPeriod_us = 1'000'000;  // DroneCAN: a client waits 1 s for its response

}  // namespace

DroneCanNode::DroneCanNode(CanBus& bus, const DroneCanNodeConfig& config)
    : bus_(bus),
      config_(config),
      receiver_(config.node_id, kSubscriptions),
      groups_{EscGroup(0, config.feedback_divider), EscGroup(1, config.feedback_divider), EscGroup(2, config.feedback_divider),
              EscGroup(3, config.feedback_divider)} {}

bool DroneCanNode::poll(std::int64_t now_us) {
  if (!started_) {
    started_ = true;
    start_us_ = next_status_us_ = next_arming_us_ = now_us;
  }
  bool heard = false;
  while (const auto received = bus_.receive()) {
    heard = true;
    const CanFrame& f = received->frame;
    const std::int64_t arrival_us = received->time_ns / 1000;
    if (!f.extended) {
      if (protocols::fast::is_feedback_id(f)) groups_[f.id >> 2 & 3u].on_frame(f, arrival_us);
      continue;
    }
    if ((f.id & 127u) == config_.node_id) {
      ++counters_.id_conflict;  // a bus never gives us our own frames
      continue;
    }
    if (const auto t = receiver_.accept(f, static_cast<std::uint64_t>(arrival_us))) on_transfer(*t, arrival_us);
  }
  for (std::size_t i = 0; i < node_count_; ++i) {
    if (now_us - nodes_[i].last_status_us > kOffline_us) nodes_[i].online = false;
  }
  // A message that the bus refuses stays due.
  if (now_us >= next_status_us_ && broadcast(own_status(now_us), kStatusPriority, status_id_)) next_status_us_ = now_us + kStatusPeriod_us;
  if (announce_arming_ && now_us >= next_arming_us_) {
    const ArmingStatus arming{.status = armed_ ? ArmingStatus::kFullyArmed : ArmingStatus::kDisarmed};
    if (broadcast(arming, kArmingPriority, arming_id_)) next_arming_us_ = now_us + kArmingPeriod_us;
  }
  if (config_.request_info) request_infos(now_us);
  return heard;
}

void DroneCanNode::set_armed(bool armed) {
  if (armed != armed_) next_arming_us_ = start_us_;  // due
  armed_ = armed;
}

bool DroneCanNode::send_raw(std::span<const float> duty) {
  RawCommand c;
  for (const float d : duty.first(std::min(duty.size(), RawCommand::kMaxItems))) {
    c.command[c.count++] = static_cast<std::int16_t>(
        protocols::fast::quantise(d, 1.0f / static_cast<float>(RawCommand::kFullScale), -RawCommand::kFullScale, RawCommand::kFullScale));
  }
  return broadcast(c, kCommandPriority, raw_id_);
}

bool DroneCanNode::send_rpm(std::span<const float> speed_rad_s) {
  RpmCommand c;
  for (const float w : speed_rad_s.first(std::min(speed_rad_s.size(), RpmCommand::kMaxItems))) {
    c.rpm[c.count++] = protocols::fast::quantise(w, protocols::fast::kRadPerSecondPerRpm, -131071, 131071);
  }
  return broadcast(c, kCommandPriority, rpm_id_);
}

bool DroneCanNode::send_fast(int group, protocols::fast::SetpointMode mode, const std::array<float, 4>& values, std::int64_t now_us) {
  // The version of the layout goes before the first set-point and then every second: an ESC with another one refuses and says so.
  std::int64_t& version_us = next_version_us_[static_cast<std::size_t>(group)];
  if (now_us >= version_us && bus_.send(protocols::fast::encode_version(static_cast<std::uint8_t>(group))) == SendStatus::queued) {
    version_us = now_us + kVersionPeriod_us;
  }
  if (bus_.send(groups_[static_cast<std::size_t>(group)].encode(mode, values, now_us)) == SendStatus::queued) return true;
  ++counters_.rejected_tx;
  return false;
}

const NodeRecord* DroneCanNode::node(std::uint8_t node_id) const {
  for (const NodeRecord& n : nodes()) {
    if (n.node_id == node_id) return &n;
  }
  return nullptr;
}

void DroneCanNode::on_transfer(const protocols::Transfer& t, std::int64_t now_us) {
  if (t.id.kind == TransferKind::request) {
    answer_info(t, now_us);
  } else if (t.id.kind == TransferKind::response) {
    GetNodeInfoResponse info;
    const auto n = std::find_if(nodes_.begin(), nodes_.begin() + static_cast<std::ptrdiff_t>(node_count_),
                                [&](const NodeRecord& r) { return r.node_id == t.id.source; });
    if (!decode(t.payload, info)) {
      ++counters_.undecodable;
    } else if (n != nodes_.begin() + static_cast<std::ptrdiff_t>(node_count_)) {
      n->info = info;
      n->info_known = true;
    }
  } else if (t.id.data_type_id == NodeStatus::kType.id) {
    on_node_status(t, now_us);
  } else {
    EscStatus s;
    if (!decode(t.payload, s)) {
      ++counters_.undecodable;
    } else if (s.esc_index >= kMaxEscs) {
      ++counters_.foreign_index;
    } else {
      escs_[s.esc_index] = EscReport{.status = s, .node_id = t.id.source, .arrival_us = now_us};
    }
  }
}

void DroneCanNode::on_node_status(const protocols::Transfer& t, std::int64_t now_us) {
  NodeStatus s;
  if (!decode(t.payload, s)) {
    ++counters_.undecodable;
    return;
  }
  std::size_t i = 0;
  while (i < node_count_ && nodes_[i].node_id != t.id.source) ++i;
  if (i == node_count_) {
    // A node that went offline gives up its place before a new one is turned away.
    if (node_count_ == kMaxNodes) {
      i = 0;
      while (i < kMaxNodes && nodes_[i].online) ++i;
      if (i == kMaxNodes) {
        ++counters_.too_many_nodes;
        return;
      }
    } else {
      ++node_count_;
    }
    nodes_[i] = {};
    nodes_[i].node_id = t.id.source;
    request_id_[i] = {};
    next_request_us_[i] = now_us;
  }
  NodeRecord& n = nodes_[i];
  if (s.uptime_s < n.status.uptime_s) {
    // Restarted: perhaps with other software, perhaps another device.
    ++n.restarts;
    n.info_known = false;
    next_request_us_[i] = now_us;
  }
  n.status = s;
  n.last_status_us = now_us;
  n.online = s.mode != protocols::NodeMode::offline;
}

NodeStatus DroneCanNode::own_status(std::int64_t now_us) const {
  return {.uptime_s = static_cast<std::uint32_t>((now_us - start_us_) / 1'000'000),
          .health = protocols::Health::ok,
          .mode = protocols::NodeMode::operational};
}

void DroneCanNode::answer_info(const protocols::Transfer& request, std::int64_t now_us) {
  GetNodeInfoResponse r;
  r.status = own_status(now_us);
  r.software_minor = 1;
  r.unique_id = config_.unique_id;
  r.set_name(config_.name);
  std::array<std::uint8_t, GetNodeInfoResponse::kMaxBytes> payload{};
  const std::size_t size = encode(r, payload);
  send({.kind = TransferKind::response,
        .priority = request.id.priority,
        .data_type_id = GetNodeInfo::kType.id,
        .source = config_.node_id,
        .destination = request.id.source},
       GetNodeInfo::kType.crc_seed(), request.transfer_id, {payload.data(), size});
}

// One request per poll and per second and node, until it answers.
void DroneCanNode::request_infos(std::int64_t now_us) {
  for (std::size_t i = 0; i < node_count_; ++i) {
    if (nodes_[i].info_known || !nodes_[i].online || now_us < next_request_us_[i]) continue;
    next_request_us_[i] = now_us + kRequestPeriod_us;
    send({.kind = TransferKind::request,
          .priority = kRequestPriority,
          .data_type_id = GetNodeInfo::kType.id,
          .source = config_.node_id,
          .destination = nodes_[i].node_id},
         GetNodeInfo::kType.crc_seed(), request_id_[i].next(), {});
    return;
  }
}

template <class T>
bool DroneCanNode::broadcast(const T& value, std::uint8_t priority, protocols::TransferIdCounter& id) {
  static constexpr std::uint16_t kSeed = T::kType.crc_seed();
  std::array<std::uint8_t, T::kMaxBytes> payload{};
  const std::size_t size = encode(value, payload);
  return send({.kind = TransferKind::message, .priority = priority, .data_type_id = T::kType.id, .source = config_.node_id}, kSeed,
              id.next(), {payload.data(), size});
}

bool DroneCanNode::send(const FrameId& header, std::uint16_t seed, std::uint8_t transfer_id, std::span<const std::uint8_t> payload) {
  return protocols::encode_transfer(header, seed, transfer_id, payload, [this](const CanFrame& f) {
    if (bus_.send(f) == SendStatus::queued) return true;
    ++counters_.rejected_tx;
    return false;
  });
}

}  // namespace rotorloop::host
