// The host on the ESC bus, as a flight computer or a bench needs it: announces itself, arms, commands, watches the other
// nodes and collects what the ESCs report. Works on any CanBus, never blocks, has no clock (times are handed in, µs of the
// bus's clock) and no heap.
//   loop: node.poll(now); ... node.send_rpm(...) or node.send_fast(0, ...)
// Not for several threads.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "host/bus/can_bus.hpp"
#include "host/node/esc_group.hpp"
#include "protocols/receiver.hpp"
#include "protocols/types.hpp"

namespace rotorloop::host {

struct DroneCanNodeConfig {
  std::uint8_t node_id = 120;  // 1..125; 126 and 127 are for tools
  const char* name = "org.rotorloop.host";
  std::array<std::uint8_t, 16> unique_id{};  // answered to GetNodeInfo
  bool request_info = true;                  // ask nodes that appear who they are
  int feedback_divider = 1;                  // 1000 / fast_feedback_Hz of the ESCs
};

// A node seen on the bus. Offline 3 s after its last NodeStatus (DroneCAN's limit).
struct NodeRecord {
  std::uint8_t node_id = 0;
  bool online = false;
  bool info_known = false;
  protocols::NodeStatus status;
  std::int64_t last_status_us = 0;
  protocols::GetNodeInfoResponse info;
  std::uint32_t restarts = 0;  // uptime ran backwards
};

struct EscReport {
  protocols::EscStatus status;
  std::uint8_t node_id = 0;
  std::int64_t arrival_us = 0;
};

struct DroneCanNodeCounters {
  std::uint32_t rejected_tx = 0;     // frames that the bus did not take (queue full or bus off)
  std::uint32_t too_many_nodes = 0;  // NodeStatus of nodes beyond kMaxNodes
  std::uint32_t undecodable = 0;     // transfers with too short a payload
  std::uint32_t foreign_index = 0;   // esc.Status with an index beyond kMaxEscs
  std::uint32_t id_conflict = 0;     // frames that carry our own node id
};

class DroneCanNode {
 public:
  static constexpr std::size_t kMaxNodes = 16, kMaxEscs = 16;
  static constexpr std::int64_t kOffline_us = 3'000'000;

  // `bus` must outlive the node.
  DroneCanNode(CanBus& bus, const DroneCanNodeConfig& config);

  // Takes all waiting frames, sends what is due (NodeStatus 1 Hz, ArmingStatus every 500 ms, requests). At least every 100 ms,
  // and as often as fast feedback is wanted fresh. True when a frame was among them: only then can what the ESCs report differ.
  bool poll(std::int64_t now_us);

  // Sent with the next poll and then every 500 ms: 255 or 0. The node starts disarmed.
  void set_armed(bool armed);
  bool armed() const { return armed_; }
  // Stops the ArmingStatus messages altogether (an autopilot on the same bus arms).
  void announce_arming(bool on) { announce_arming_ = on; }

  // One command to all ESCs from index 0 on, at most 20; false when the bus did not take it whole. NaN is sent as 0, a stop.
  bool send_raw(std::span<const float> duty);  // -1..1
  bool send_rpm(std::span<const float> speed_rad_s);
  // Fast channel, one group. NaN: no order for this ESC.
  bool send_fast(int group, protocols::fast::SetpointMode mode, const std::array<float, 4>& values, std::int64_t now_us);

  const EscGroup& group(int g) const { return groups_[static_cast<std::size_t>(g)]; }
  // Nodes in the order in which they appeared.
  std::span<const NodeRecord> nodes() const { return {nodes_.data(), node_count_}; }
  const NodeRecord* node(std::uint8_t node_id) const;
  // Last esc.Status of this index, if any.
  const std::optional<EscReport>& esc(int index) const { return escs_[static_cast<std::size_t>(index)]; }

  const DroneCanNodeCounters& counters() const { return counters_; }
  const protocols::ReceiverCounters& receiver_counters() const { return receiver_.counters(); }

 private:
  void on_transfer(const protocols::Transfer& t, std::int64_t now_us);
  void on_node_status(const protocols::Transfer& t, std::int64_t now_us);
  void answer_info(const protocols::Transfer& request, std::int64_t now_us);
  void request_infos(std::int64_t now_us);
  protocols::NodeStatus own_status(std::int64_t now_us) const;
  template <class T>
  bool broadcast(const T& value, std::uint8_t priority, protocols::TransferIdCounter& id);
  bool send(const protocols::FrameId& header, std::uint16_t seed, std::uint8_t transfer_id, std::span<const std::uint8_t> payload);

  CanBus& bus_;
  DroneCanNodeConfig config_;
  // Sessions: NodeStatus, esc.Status and a response per node, and requests of tools.
  protocols::Receiver<3 * kMaxNodes + 4, protocols::GetNodeInfoResponse::kMaxBytes> receiver_;
  std::array<EscGroup, 4> groups_;
  std::array<NodeRecord, kMaxNodes> nodes_{};
  std::array<std::int64_t, kMaxNodes> next_request_us_{};
  std::array<protocols::TransferIdCounter, kMaxNodes> request_id_{};
  std::array<std::optional<EscReport>, kMaxEscs> escs_{};
  DroneCanNodeCounters counters_;
  protocols::TransferIdCounter status_id_, arming_id_, raw_id_, rpm_id_;
  std::size_t node_count_ = 0;
  std::int64_t start_us_ = 0, next_status_us_ = 0, next_arming_us_ = 0;
  std::array<std::int64_t, 4> next_version_us_{};  // of each group of the fast channel
  bool started_ = false, armed_ = false, announce_arming_ = true;
};

}  // namespace rotorloop::host
