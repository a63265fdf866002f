#include "host/bus/live/socketcan/frame_codec.hpp"

#include <cstring>

namespace rotorloop {

SocketCanContent decode_socketcan(const canfd_frame& raw, std::size_t bytes, BusFrame& frame) {
  if (bytes != CAN_MTU && bytes != CANFD_MTU) return SocketCanContent::malformed;
  if ((raw.can_id & CAN_ERR_FLAG) != 0) return SocketCanContent::error_report;
  if ((raw.can_id & CAN_RTR_FLAG) != 0) return SocketCanContent::remote;
  BusFrame f;
  f.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  f.id = raw.can_id & (f.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  f.fd = bytes == CANFD_MTU;
  f.bit_rate_switch = f.fd && (raw.flags & CANFD_BRS) != 0;
  f.length = raw.len;
  if (!possible_length(f.fd, f.length)) return SocketCanContent::malformed;
  std::memcpy(f.data.data(), raw.data, f.length);
  frame = f;
  return SocketCanContent::frame;
}

std::size_t encode_socketcan(const BusFrame& frame, canfd_frame& raw) {
  raw = {};
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0u);
  raw.len = frame.length;
  if (frame.fd && frame.bit_rate_switch) raw.flags = CANFD_BRS;
  std::memcpy(raw.data, frame.data.data(), frame.length);
  return frame.fd ? CANFD_MTU : CAN_MTU;
}

can_filter kernel_filter(const CanFilter& filter) {
  can_filter f{};
  f.can_id = filter.id | (filter.extended ? CAN_EFF_FLAG : 0u);
  f.can_mask = (filter.mask & (filter.extended ? CAN_EFF_MASK : CAN_SFF_MASK)) | CAN_EFF_FLAG;
  return f;
}

}  // namespace rotorloop
