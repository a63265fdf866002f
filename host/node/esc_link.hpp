// A flight computer's four ESCs as it needs them: "all there?", "arm", "these speeds", "what do you do?". Puts together what
// the DroneCAN node hears on the bus; speeds go over the fast channel, or as esc.RPMCommand when that is off.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "host/node/dronecan_node.hpp"
#include "host/vehicle/model.hpp"

namespace rotorloop::host {

struct EscLinkConfig {
  std::uint8_t node_id = 10;
  std::array<std::uint8_t, kRotors> esc_node_ids{21, 22, 23, 24};  // esc_index 0..3
  bool fast_channel = true;
  int feedback_divider = 1;  // 1000 / fast_feedback_Hz of the ESCs
};

struct EscState {
  double speed_rad_s = std::numeric_limits<double>::quiet_NaN();  // NaN: not known, or never heard
  double current_A = 0.0;                                         // torque current of the feedback
  double bus_V = 0.0, bus_A = 0.0;
  bool fault = false;           // NodeStatus: health error or critical
  std::uint8_t fault_code = 0;  // low byte of the vendor status (docs/wire.md); also of a fault that the ESC is still trying to end
  std::int64_t heard_us = -1;   // last speed: feedback, or esc.Status when the fast channel is off; -1: never
};

class EscLink {
 public:
  EscLink(const EscLinkConfig& config, CanBus& port);

  // Takes what arrived and sends what is due; call often.
  void poll(std::int64_t now_us) {
    if (node_.poll(now_us)) collect();
  }
  void arm(bool armed) {
    if (armed != node_.armed()) node_.set_armed(armed);
  }
  // Mechanical speeds, rad/s; 0 stops.
  void command(const std::array<double, kRotors>& omega_rad_s, std::int64_t now_us);

  const EscState& esc(std::size_t i) const { return escs_[i]; }  // as of the last poll()
  bool all_operational() const { return first_missing() < 0; }
  int first_missing() const;  // index of the first ESC that is offline or not operational; -1: all there
  const DroneCanNode& node() const { return node_; }

 private:
  // Once per frame heard instead of once per question: the flight computer asks at every poll.
  void collect();
  EscState state_of(std::size_t i) const;

  EscLinkConfig config_;
  DroneCanNode node_;
  std::array<EscState, kRotors> escs_{};
};

}  // namespace rotorloop::host
