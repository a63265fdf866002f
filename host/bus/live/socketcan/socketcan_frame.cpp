#include "host/bus/live/socketcan/socketcan_frame.hpp"

#include <linux/can/error.h>

#include <cstring>

namespace rotorloop {
namespace {

constexpr std::uint8_t kCounters = 6;  // data[6] and data[7]: transmit and receive error counters

}  // namespace

SocketCanFrame to_socketcan(const BusFrame& frame) {
  SocketCanFrame out;
  out.raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0u);
  out.raw.len = frame.length;
  std::memcpy(out.raw.data, frame.data.data(), frame.length);
  if (frame.fd) out.raw.flags = static_cast<__u8>(CANFD_FDF | (frame.bit_rate_switch ? CANFD_BRS : 0));
  out.size = frame.fd ? CANFD_MTU : CAN_MTU;
  return out;
}

SocketCanContent from_socketcan(std::span<const std::uint8_t> bytes, BusFrame& out) {
  if (bytes.size() != CAN_MTU && bytes.size() != CANFD_MTU) return SocketCanContent::malformed;
  canfd_frame raw{};
  std::memcpy(&raw, bytes.data(), bytes.size());
  if ((raw.can_id & CAN_ERR_FLAG) != 0) return SocketCanContent::error_report;
  if ((raw.can_id & CAN_RTR_FLAG) != 0) return SocketCanContent::remote;
  out = BusFrame();
  out.fd = bytes.size() == CANFD_MTU;
  out.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  out.id = raw.can_id & (out.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  out.bit_rate_switch = out.fd && (raw.flags & CANFD_BRS) != 0;
  out.length = raw.len;
  if (!possible(out)) return SocketCanContent::malformed;
  std::memcpy(out.data.data(), raw.data, raw.len);
  return SocketCanContent::frame;
}

BusErrorReport error_report(const can_frame& f) {
  BusErrorReport r;
  r.no_acknowledge = (f.can_id & CAN_ERR_ACK) != 0;
  r.lost_arbitration = (f.can_id & CAN_ERR_LOSTARB) != 0;
  r.protocol = (f.can_id & CAN_ERR_PROT) != 0;
  if ((f.can_id & CAN_ERR_CRTL) != 0) {
    const int controller = f.data[1];
    r.receive_overflow = (controller & CAN_ERR_CRTL_RX_OVERFLOW) != 0;
    if ((controller & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0)
      r.state = BusState::error_passive;
    else if ((controller & (CAN_ERR_CRTL_ACTIVE | CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0)
      r.state = BusState::error_active;
  }
  if ((f.can_id & CAN_ERR_RESTARTED) != 0) r.restarted = true, r.state = BusState::error_active;
  if ((f.can_id & CAN_ERR_BUSOFF) != 0) r.state = BusState::bus_off;
  // Before Linux 6.0 drivers gave the counters without a flag: there zeros say nothing.
  const bool flagged = (f.can_id & 0x200u) != 0;  // CAN_ERR_CNT, which older headers lack
  if (flagged || f.data[kCounters] != 0 || f.data[kCounters + 1] != 0)
    r.sent_errors = f.data[kCounters], r.heard_errors = f.data[kCounters + 1];
  return r;
}

std::string words(const BusErrorReport& r) {
  std::string text;
  const auto add = [&](bool is, const std::string& what) {
    if (is) text += (text.empty() ? "" : ", ") + what;
  };
  add(r.restarted, "restarted after bus-off");
  if (r.state && !r.restarted)
    add(true, *r.state == BusState::bus_off ? "bus-off" : *r.state == BusState::error_passive ? "error passive" : "error active");
  add(r.no_acknowledge, "nobody acknowledges");
  add(r.receive_overflow, "the controller's receive buffer overflowed");
  add(r.protocol, "frames with errors on the bus");
  add(r.lost_arbitration, "arbitration lost");
  if (r.sent_errors)
    add(true, "error counters " + std::to_string(*r.sent_errors) + " sending, " + std::to_string(*r.heard_errors) + " receiving");
  return text.empty() ? "an error that the driver does not describe" : text;
}

}  // namespace rotorloop
