// A flight computer's four ESCs as it needs them: "all there?", "arm", "these speeds", "what do you do?". Speaks DroneCAN for
// presence, arming and slow telemetry, and the fast channel (or esc.RPMCommand when that is off) for speeds.
#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "host/bus/can_bus.hpp"
#include "host/vehicle/model.hpp"
#include "protocols/fast_channel.hpp"
#include "protocols/receiver.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types.hpp"

namespace rotorloop::host {

struct EscLinkConfig {
  std::uint8_t node_id = 10;
  std::array<std::uint8_t, kRotors> esc_node_ids{21, 22, 23, 24};  // esc_index 0..3
  bool fast_channel = true;                 // false: esc.RPMCommand with every command()
  std::int64_t node_timeout_us = 3'000'000; // DroneCAN: offline after 3 s without NodeStatus
};

struct EscState {
  double speed_rad_s = std::numeric_limits<double>::quiet_NaN();  // NaN: the ESC says it does not know
  double current_A = 0.0;         // torque current of the feedback
  double bus_V = 0.0, bus_A = 0.0;
  bool operational = false;       // NodeStatus: operational and healthy
  bool fault = false;             // NodeStatus: health error or critical
  std::int64_t heard_us = -1;     // last speed: feedback, or esc.Status when the fast channel is off
  std::int64_t node_heard_us = -1;
};

struct EscLinkCounters {
  std::uint64_t commands = 0;
  std::uint64_t refused = 0;         // frames that the bus did not take
  std::uint64_t foreign = 0;         // feedback of an ESC that is not ours
  std::uint64_t feedback = 0;
  std::uint64_t sequence_lost = 0;   // set-points that an ESC never answered
};

class EscLink {
 public:
  EscLink(const EscLinkConfig& config, CanBus& port);

  void on_frame(const CanFrame& frame, std::int64_t now_us);
  // NodeStatus every second, ArmingStatus every half second and at once when it changes.
  void poll(std::int64_t now_us);
  void arm(bool armed) { armed_ = armed; }
  // Mechanical speeds, rad/s, 0 stops.
  void command(const std::array<double, kRotors>& omega_rad_s, std::int64_t now_us);

  const EscState& esc(std::size_t i) const { return escs_[i]; }
  bool all_operational(std::int64_t now_us) const { return first_missing(now_us) < 0; }
  int first_missing(std::int64_t now_us) const;  // -1: all there
  const EscLinkCounters& counters() const { return counters_; }

 private:
  void on_transfer(const protocols::Transfer& t, std::int64_t now_us);
  void send_message(const protocols::DataType& type, std::uint8_t priority, protocols::TransferIdCounter& id,
                    std::span<const std::uint8_t> payload);
  void send(const CanFrame& frame) { counters_.refused += port_.send(frame) == SendStatus::queued ? 0u : 1u; }
  int index_of(std::uint8_t node) const;

  EscLinkConfig config_;
  CanBus& port_;
  protocols::Receiver<16, protocols::EscStatus::kMaxBytes> receiver_;
  std::array<EscState, kRotors> escs_{};
  std::array<int, kRotors> last_sequence_{-1, -1, -1, -1};
  EscLinkCounters counters_;
  protocols::fast::Setpoint setpoint_{};
  protocols::TransferIdCounter node_status_id_, arming_id_, rpm_id_;
  bool armed_ = false, arming_sent_as_ = false;
  std::int64_t next_node_status_us_ = 0, next_arming_us_ = 0;
};

}  // namespace rotorloop::host
