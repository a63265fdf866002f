#include "host/node/esc_link.hpp"

#include "host/base/constants.hpp"

namespace rotorloop::host {
namespace {}

EscLink::EscLink(const EscLinkConfig& config, CanBus& port)
    : config_(config),
      node_(port, {.node_id = config.node_id,
                   .name = "org.rotorloop.flight_computer",
                   .unique_id = {0x52, 0x4C, config.node_id},
                   .request_info = true,
                   .feedback_divider = config.feedback_divider}) {}

void EscLink::command(const std::array<double, kRotors>& omega_rad_s, std::int64_t now_us) {
  std::array<float, kRotors> speeds{};
  for (std::size_t i = 0; i < kRotors; ++i) speeds[i] = static_cast<float>(omega_rad_s[i]);
  if (config_.fast_channel) {
    node_.send_fast(0, protocols::fast::SetpointMode::rpm, speeds, now_us);
  } else {
    node_.send_rpm(speeds);
  }
}

void EscLink::collect() {
  for (std::size_t i = 0; i < kRotors; ++i) escs_[i] = state_of(i);
}

EscState EscLink::state_of(std::size_t i) const {
  EscState e;
  const int index = static_cast<int>(i);
  if (const auto& report = node_.esc(index)) {
    e.bus_V = static_cast<double>(report->status.voltage_V);
    e.bus_A = static_cast<double>(report->status.current_A);
    if (!config_.fast_channel) {
      e.speed_rad_s = report->status.rpm * kRad_s_per_rpm;
      e.heard_us = report->arrival_us;
    }
  }
  const EscFeedback& feedback = node_.group(0).esc(index);
  if (config_.fast_channel && feedback.heard) {
    e.speed_rad_s = static_cast<double>(feedback.last.speed_rad_s());
    e.current_A = static_cast<double>(feedback.last.current_A());
    if (feedback.last.bus_10mV) e.bus_V = 0.01 * *feedback.last.bus_10mV;
    e.heard_us = feedback.arrival_us;
  }
  if (const NodeRecord* n = node_.node(config_.esc_node_ids[i])) {
    e.fault = n->status.health >= protocols::Health::error;
    e.fault_code = static_cast<std::uint8_t>(n->status.vendor_status & 0xFFu);
  }
  return e;
}

int EscLink::first_missing() const {
  for (std::size_t i = 0; i < kRotors; ++i) {
    const NodeRecord* n = node_.node(config_.esc_node_ids[i]);
    if (!n || !n->online || n->status.mode != protocols::NodeMode::operational || n->status.health >= protocols::Health::error)
      return static_cast<int>(i);
  }
  return -1;
}

}  // namespace rotorloop::host
