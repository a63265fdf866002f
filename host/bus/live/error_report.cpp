#include "host/bus/live/error_report.hpp"

#include <linux/can/error.h>

namespace rotorloop {
namespace {

constexpr std::uint32_t kCountersGiven = 0x200;  // CAN_ERR_CNT, in headers from Linux 6.0 on; older kernels fill the bytes without it

std::string counters_text(const ErrorReport& r) {
  if (!r.errors_tx_rx) return {};
  return " (errors counted: " + std::to_string((*r.errors_tx_rx)[0]) + " sending, " + std::to_string((*r.errors_tx_rx)[1]) + " receiving)";
}

}  // namespace

ErrorReport decode_error_report(const canfd_frame& raw) {
  ErrorReport r;
  const std::uint32_t classes = raw.can_id & CAN_ERR_MASK;
  if ((classes & CAN_ERR_CRTL) != 0) {
    const std::uint8_t controller = raw.data[1];
    r.receive_overflow = (controller & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
    r.warning = (controller & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0;
    if (r.warning || (controller & CAN_ERR_CRTL_ACTIVE) != 0) r.state = BusState::error_active;
    if ((controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) r.state = BusState::error_passive;
  }
  r.no_acknowledge = (classes & CAN_ERR_ACK) != 0;
  r.bus_error = (classes & (CAN_ERR_PROT | CAN_ERR_BUSERROR | CAN_ERR_TRX)) != 0;
  r.restarted = (classes & CAN_ERR_RESTARTED) != 0;
  if (r.restarted) r.state = BusState::error_active;
  if ((classes & CAN_ERR_BUSOFF) != 0) r.state = BusState::bus_off;
  if ((classes & kCountersGiven) != 0 || raw.data[6] != 0 || raw.data[7] != 0) r.errors_tx_rx = {raw.data[6], raw.data[7]};
  return r;
}

std::optional<std::string> ErrorState::take(const ErrorReport& r) {
  std::optional<std::string> notice;
  const bool acknowledge_missed = r.no_acknowledge && !nobody_;
  nobody_ = nobody_ || r.no_acknowledge;
  if (r.receive_overflow && !overflow_reported_) {
    overflow_reported_ = true;
    notice = "the controller's receive buffer was full: frames are lost before the system sees them";
  }
  if (acknowledge_missed) notice = "nobody acknowledges: no other node is on the bus, or none at this bit rate";
  const BusState before = std::exchange(state_, r.state.value_or(state_));
  const bool warned_before = std::exchange(warning_, r.state ? r.warning : warning_);
  if (state_ == before && (warning_ == warned_before || state_ != BusState::error_active)) return notice;
  switch (state_) {
    case BusState::bus_off:
      return "bus-off: the controller has left the bus after too many errors; check wiring, termination and bit rate of all nodes; " +
             after_bus_off_;
    case BusState::error_passive:
      return (nobody_ ? "error passive, as nobody acknowledges: no other node is on the bus, or none at this bit rate"
                      : "error passive: many errors; check wiring, termination and bit rate") +
             counters_text(r);
    case BusState::error_active:
      break;
  }
  if (warning_) return "error warning: a counter of errors is above 96" + counters_text(r);
  return r.restarted ? "on the bus again after a restart" : "error active again: the bus is well";
}

}  // namespace rotorloop
