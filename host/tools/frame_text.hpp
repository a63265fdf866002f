// What one frame is, in a line: by its identifier alone, without the transfer that it belongs to.
#pragma once
#include <string>

#include "host/bus/bus_frame.hpp"

namespace rotorloop::tools {

struct FrameKind {
  std::string type;           // "esc.RawCommand", "fast set-point", "message 20641"
  int source = -1;            // node id; 0: anonymous; -1: the frame has none
  int destination = -1;       // node id of a service; -1: everyone
  std::string role;           // "message", "request", "response", "" for 11-bit frames
  bool moves_motors = false;  // a command, or an order to arm: what a replay must not send unasked
};

FrameKind frame_kind(const BusFrame& frame);

// "120 -> *", "120 -> 21", "anonymous -> *"; empty for frames without a source.
std::string addresses(const FrameKind& kind);

// "07040678", "0A0"; data "0003FDF0080010DF".
std::string id_text(const BusFrame& frame);
std::string data_text(const BusFrame& frame);

}  // namespace rotorloop::tools
